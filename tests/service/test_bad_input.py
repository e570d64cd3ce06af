"""Every operation with every kind of bad input: a problem with cause and remedy, and never status 500."""

import gzip
import re
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from test_problems import problem

Request = tuple[str, dict[str, Any]]
"""The path, and the options of the client."""
NAMES = ("..%2f..%2fetc%2fpasswd", "%00", "a%0d%0ab", "%ff%fe", "%C3%A9" * 100, "a" * 5000, "-", "nowhere")
NUMBERS = ("9223372036854775808", "-1", "1e400", "nan", "0x1", "1_0", "", "9" * 5000)
BODIES = (b"", b"\xff\xfe{", b"\x00" * 100, b"[" * 10_000, gzip.compress(b"{}"))


def bad(path: str, operation: dict[str, Any], kind: str) -> Iterator[Request]:
    """Requests of one kind, all of which the operation has to refuse."""
    plain = re.sub(r"{n}", "0", re.sub(r"{(id|name)}", "nowhere", path))
    media_types = list(operation.get("requestBody", {"content": {}})["content"])
    queries = [one for one in operation.get("parameters", ()) if one["in"] == "query"]
    match kind:
        case "name":
            parameters = re.findall(r"{\w+}", path)
            yield from ((re.sub(r"{\w+}", name, path), {}) for name in NAMES if parameters and not media_types)
        case "query":
            yield plain, {"params": {"nosuch": "1"}}
            yield from ((plain, {"params": [(one["name"], "1"), (one["name"], "2")]}) for one in queries
                        if one["schema"].get("type") != "array")
        case "number":
            integers = [one["name"] for one in queries if one["schema"].get("type") == "integer"]
            yield from ((plain, {"params": {name: number}}) for name in integers for number in NUMBERS)
        case "encoding" if media_types:
            yield from ((plain, {"content": body, "headers": {"Content-Type": media_type}})
                        for media_type in media_types for body in BODIES)
        case "media type" if media_types:
            yield from ((plain, {"content": b"{}", "headers": header}) for header in (
                {"Content-Type": "text/html"}, {"Content-Type": "; charset=\xff".encode("latin-1")}, {}))
        case "size" if media_types:
            yield from ((plain, {"content": b" " * (9 << 20), "headers": {"Content-Type": media_type}})
                        for media_type in media_types)
        case "key" if any(one["name"] == "Idempotency-Key" for one in operation.get("parameters", ())):
            yield from ((plain, {"json": {}, "headers": {"Idempotency-Key": key}})
                        for key in ("", "a b", "-a", "a" * 65, "\xe9".encode("latin-1")))
        case "header":
            yield plain, {"headers": {"Host": "evil.example"}}


def require_reason(path: str, response: httpx.Response) -> None:
    """Cause and remedy, which clients of UM-Bridge get in the form of their protocol."""
    if path.startswith("/umbridge/"):
        error = response.json()["error"]
        assert error["type"]
        assert len(error["message"].split(". ")) > 1, error
    else:
        problem(response, response.status_code)


KINDS = ("name", "query", "number", "encoding", "media type", "size", "key", "header")


@pytest.mark.parametrize("kind", KINDS)
def test_every_operation_refuses_bad_input(client: httpx.Client, kind: str) -> None:
    count = 0
    for path, methods in client.get("/openapi.json").json()["paths"].items():
        for method, operation in methods.items():
            for address, options in bad(path, operation, kind):
                response = client.request(method, address, **options)
                assert 400 <= response.status_code < 500, (method, address[:80], options, response.text[:300])
                require_reason(path, response)
                count += 1
    assert count >= 8
    assert client.get("/v1/health").is_success
