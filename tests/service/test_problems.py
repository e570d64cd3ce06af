"""Invalid, unexpected and misread input: every operation answers with a problem that has a cause and a remedy."""

import gzip
import io
import json
import re
import socket
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest

from service import npy
from service.failures import UnexpectedErrors
from service.problem_details import MEDIA_TYPE, ProblemDetails
from service.settings import Settings
from slipstick.errors import UnknownName

JSON = {"Content-Type": "application/json"}
INPUTS: dict[str, Any] = {"mean": [1.0, 1.0], "std": [0.05, 0.05]}
POSTS = {
    "/v1/evaluate": {"points": [[1.0, 1.0]]},
    "/v1/propagate": {"inputs": INPUTS, "conditions": [0]},
    "/v1/likelihood": {"candidates": [{**INPUTS, "output_std": 0.01}]},
    "/v1/fits": {"settings": {"generations": 1}},
}


def npy_file(array: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def problem(response: httpx.Response, status: int) -> dict[str, Any]:
    """Check that a response is a problem with the expected status, and return it."""
    assert response.status_code == status, response.text
    assert response.headers["Content-Type"] == MEDIA_TYPE
    content: dict[str, Any] = json.loads(response.content, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))
    ProblemDetails.model_validate(content)
    assert content["status"] == status
    assert all(content[name] for name in ("type", "title", "detail", "remedy"))
    return content


@pytest.mark.parametrize("path", POSTS)
@pytest.mark.parametrize("body", [b"", b"{", b'{"a": NaN}', b'{"a": 1e999}', b'{"table": "\\ud800"}', b"\xff\xfe{}",
                                  b"[" * 100_000])
def test_a_body_that_is_not_json(client: httpx.Client, path: str, body: bytes) -> None:
    response = client.post(path, content=body, headers=JSON)
    problem(response, 422 if body == b"" and path != "/v1/evaluate" else 400)


@pytest.mark.parametrize("path", POSTS)
def test_a_body_of_the_wrong_media_type(client: httpx.Client, path: str) -> None:
    wrong = client.post(path, content=json.dumps(POSTS[path]), headers={"Content-Type": "text/plain"})
    assert "--json" in problem(wrong, 415)["remedy"]


@pytest.mark.parametrize("path", POSTS)
@pytest.mark.parametrize("body", ["null", "[]", "3", '"x"', '{"tabel": "nominal"}', '{"table": 3}', '{"outside": "x"}'])
def test_json_that_does_not_match_the_schema(client: httpx.Client, path: str, body: str) -> None:
    assert problem(client.post(path, content=body, headers=JSON), 422)["errors"]


@pytest.mark.parametrize(("path", "body", "what"), [
    ("/v1/evaluate", [], "Input should be a JSON object"),
    ("/v1/fits", {"settings": 3}, "Input should be a JSON object"),
    ("/v1/evaluate", {"points": 3}, "Input should be a JSON array"),
    ("/v1/fits", {"settings": {"mean_bounds": [3]}}, "Input should be a JSON array"),
    ("/v1/likelihood", {"candidates": [{**INPUTS, "output_std": 0.01}], "lines": 17}, "17 is not a power of two"),
])
def test_the_error_for_a_wrong_type_speaks_of_json(client: httpx.Client, path: str, body: Any, what: str) -> None:
    said, = problem(client.post(path, json=body), 422)["errors"]
    assert said["what"].startswith(what)


@pytest.mark.parametrize(("path", "body", "where", "nearest"), [
    ("/v1/evaluate", {"tabel": "nominal"}, "body.tabel", "table"),
    ("/v1/propagate", {"inputs": {**INPUTS, "meen": [1]}}, "body.inputs.meen", "mean"),
    ("/v1/likelihood", {"candidates": [{**INPUTS, "outputstd": 0.01}]}, "body.candidates.0.outputstd", "output_std"),
    ("/v1/fits", {"settings": {"generation": 1}}, "body.settings.generation", "generations"),
    ("/v1/studies", {"recording": "measured"}, "body.recording", "recordings"),
    ("/v1/studies", {"settings": {"catalog": ["x"]}}, "body.settings.catalog", "catalogue"),
])
def test_the_error_for_an_unknown_key_suggests_the_nearest_one(client: httpx.Client, path: str, body: dict[str, Any],
                                                               where: str, nearest: str) -> None:
    errors = problem(client.post(path, json={**POSTS.get(path, {}), **body}), 422)["errors"]
    said, = (error["what"] for error in errors if error["where"].endswith(where.partition(".")[2]))
    assert said.startswith(f"The key is unknown; did you mean '{nearest}'? Known: ")


@pytest.mark.parametrize("path", POSTS)
def test_the_error_for_an_unknown_table_suggests_the_nearest_name(client: httpx.Client, path: str) -> None:
    assert "'nominal'" in problem(client.post(path, json={**POSTS[path], "table": "nominl"}), 404)["remedy"]


@pytest.mark.parametrize(("path", "change"), [
    ("/v1/evaluate", {"points": []}), ("/v1/evaluate", {"points": [[1.0]]}),
    ("/v1/evaluate", {"points": [[1.0, 1.0], [1.0]]}), ("/v1/evaluate", {"points": [[1.0, "x"]]}),
    ("/v1/evaluate", {"conditions": [216]}),
    ("/v1/evaluate", {"conditions": [-1]}), ("/v1/evaluate", {"conditions": []}),
    ("/v1/propagate", {"inputs": {"mean": [1.0], "std": [0.1]}}), ("/v1/propagate", {"inputs": {"mean": [1.0, 1.0]}}),
    ("/v1/propagate", {"inputs": {**INPUTS, "mixing": [[0.1, 0], [0, 0.1]]}}),
    ("/v1/propagate", {"inputs": {"mean": [1.0, 1.0], "mixing": [[0.1, 0], [0.1]]}}),
    ("/v1/propagate", {"inputs": {"mean": [1.0, 1.0], "std": [-0.1, 0.1]}}), ("/v1/propagate", {"order": 9}),
    ("/v1/propagate", {"samples": 1000}), ("/v1/propagate", {"quantiles": [1.1]}),
    ("/v1/propagate", {"output_std": 0, "density_points": 3}),
    ("/v1/likelihood", {"candidates": []}), ("/v1/likelihood", {"candidates": [{**INPUTS, "output_std": 0}]}),
    ("/v1/fits", {"settings": {"population": 1}}), ("/v1/fits", {"settings": {"std_bounds": [[0.0, 0.1]]}}),
    ("/v1/fits", {"settings": {"mean_bounds": [[1.2, 0.8]]}}),
    ("/v1/fits", {"settings": {"mean_bounds": [[2.0, 3.0]]}}), ("/v1/fits", {"settings": {"samples": 1000}}),
    ("/v1/fits", {"settings": {"order": 12, "nodes": 5}}),
    ("/v1/fits", {"settings": {"mean_bounds": [[0.8, 1.2]] * 3}})])
def test_invalid_values(client: httpx.Client, path: str, change: dict[str, Any]) -> None:
    problem(client.post(path, json={**POSTS[path], **change}), 422)


@pytest.mark.parametrize("path", ["/v1/recordings/none", "/v1/tables/measured", "/v1/fits/none", "/v1/fits/none/result",
                                  "/v1/nothing", "/nothing", "/v1/tables/%ff", "/v1/tables/..%2fnominal"])
def test_unknown_resources(client: httpx.Client, path: str) -> None:
    problem(client.get(path), 404)


def test_the_error_for_an_unsupported_method_names_the_supported_ones(client: httpx.Client) -> None:
    response = client.delete("/v1/fits")
    assert "GET, HEAD, OPTIONS, POST" in problem(response, 405)["remedy"]
    assert response.headers["Allow"] == "GET, HEAD, OPTIONS, POST"


def test_the_number_of_listed_validation_errors_is_limited(client: httpx.Client) -> None:
    content = problem(client.post("/v1/evaluate", json={"points": [["x", "y"]] * 2_000, "conditions": [0]}), 422)
    assert len(content["errors"]) == 20
    assert content["errors_left_out"] == 4_000 - 20


def test_responses_and_computations_beyond_the_limits_are_rejected(client: httpx.Client) -> None:
    points = {"points": [[1.0, 1.0]] * 500}
    assert "npy" in problem(client.post("/v1/evaluate", json=points), 413)["remedy"]
    as_array = {"Accept": npy.MEDIA_TYPE}
    assert np.load(io.BytesIO(client.post("/v1/evaluate", json=points, headers=as_array).content)).shape == (500, 216)
    problem(client.post("/v1/evaluate", json={"points": [[1.0, 1.0]] * 2000}, headers=as_array), 413)
    problem(client.post("/v1/propagate", json={"inputs": INPUTS, "density_points": 2000}), 413)
    many = [{**INPUTS, "output_std": 0.01}] * 100
    problem(client.post("/v1/likelihood", json={"method": "sampling", "samples": 1 << 17, "candidates": many}), 413)


def test_an_incomplete_body_times_out(address: str) -> None:
    host, port = address.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=20) as connection:
        connection.sendall(b"POST /v1/evaluate HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
                           b"Content-Length: 100\r\n\r\n{")
        assert connection.recv(1000).startswith(b"HTTP/1.1 408")


@pytest.mark.parametrize("body", [
    b"", b"junk", npy_file(np.ones((3, 2)))[:-1], npy_file(np.ones((3, 2))) + b"x", npy_file(np.ones(2)),
    npy_file(np.ones((0, 2))), npy_file(np.ones((1, 2), dtype=complex)), npy_file(np.array([["a", "b"]])),
    npy_file(np.ones((1, 2))).replace(b"(1, 2)", b"(9**9,2)"), npy_file(np.ones((1, 3))),
    npy_file(np.ones((1, 2))).replace(b"(1, 2), }         ", b"(9999999999999,2)}"),
    npy_file(np.array([[np.nan, 1.0]])), npy_file(np.array([[np.inf, 1.0]]))])
def test_invalid_npy_files(client: httpx.Client, body: bytes) -> None:
    problem(client.post("/v1/evaluate", content=body, headers={"Content-Type": npy.MEDIA_TYPE}), 422)


# Every operation with every kind of bad input: a problem with cause and remedy, and never status 500.


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


# Input that would be ignored or misread is refused, unexpected input is no internal error, and nothing is echoed.


NPY = {"Content-Type": npy.MEDIA_TYPE}
CSV = {"Content-Type": "text/csv"}
TWO = ("current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]\n"
       "0,104.7197551,6,20,0.9\n0,104.7197551,6,50,0.95\n")


@pytest.mark.parametrize(("route", "content", "media_type"), [("recordings", TWO, "text/csv"),
                                                              ("benches", "title = 1", "application/toml")])
def test_a_name_that_no_header_can_hold_is_refused(client: httpx.Client, route: str, content: str,
                                                   media_type: str) -> None:
    for name in ("鋼", "é", "a\n"):
        refused = client.post(f"/v1/{route}", params={"name": name}, content=content,
                              headers={"Content-Type": media_type})
        assert "is not a valid file name" in problem(refused, 422)["detail"]


def test_a_repeated_header_is_refused(client: httpx.Client) -> None:
    """A second Content-Type decided which limit a body has, and the first one how it was read."""
    large = b'{"points": [[1.0, 1.0]' + b", [1.0, 1.0]" * 300_000 + b"]}"
    types = [("Content-Type", "application/json"), ("Content-Type", npy.MEDIA_TYPE)]
    refused = client.post("/v1/evaluate", content=large, headers=types)
    assert "Content-Type is given 2 times" in problem(refused, 422)["detail"]
    problem(client.post("/v1/evaluate", content=large, headers=types[:1]), 413)
    keys = [("Idempotency-Key", "first-of-two"), ("Idempotency-Key", "second-of-two")]
    refused = client.post("/v1/fits", json={}, headers=keys)
    assert "Idempotency-Key is given 2 times" in problem(refused, 422)["detail"]
    assert client.get("/v1/fits/first-of-two").status_code == 404


@pytest.mark.parametrize(("shape", "status"), [(b"(True, 2)", 422), (b"(1, 2)", 200)])
def test_a_shape_of_truth_values_is_refused(client: httpx.Client, shape: bytes, status: int) -> None:
    content = npy_file(np.ones((1, 2)))
    padding = b" " * (len(shape) - len(b"(1, 2)"))
    changed = content.replace(b"(1, 2), }" + padding, shape + b", }")
    assert len(changed) == len(content)
    assert client.post("/v1/evaluate", content=changed, headers=NPY).status_code == status


def test_a_connection_stays_usable_after_an_internal_error(settings: Settings, serving: Any,
                                                           monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: object) -> list[str]:
        raise ZeroDivisionError

    def statuses() -> list[int]:
        with serving(settings) as address:
            host, port = address.removeprefix("http://").split(":")
            with (socket.create_connection((host, int(port)), timeout=20) as connection,
                  connection.makefile("rb") as read):
                answers = []
                for path in ("/v1/tables", "/v1"):
                    try:
                        connection.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
                        line, length = read.readline(), 0
                    except ConnectionError:
                        line = b""
                    if not line:
                        break
                    answers.append(int(line.split()[1]))
                    while header := read.readline().strip():
                        length = int(header.split()[1]) if header.lower().startswith(b"content-length") else length
                    read.read(length)
                return answers

    monkeypatch.setattr("slipstick.storage.library.Library.tables", fail)
    assert statuses() == [500, 200]
    # Without the outermost layer, the server resets the connection after the response.
    monkeypatch.setattr(UnexpectedErrors, "__call__", lambda layer, *call: layer.app(*call))
    assert statuses() == [500]


def test_unknown_and_repeated_query_parameters_are_refused(client: httpx.Client) -> None:
    assert "Did you mean 'limit'?" in problem(client.get("/v1/fits?limits=3"), 422)["remedy"]
    for path in ("/v1?x=1", "/v1/tables/nominal?x=1", "/v1/fits?limit=1&limit=2"):
        problem(client.get(path), 422)
    problem(client.post("/v1/evaluate?table=nominal", json=POSTS["/v1/evaluate"]), 422)
    problem(client.post("/v1/evaluate?condition=0", content=npy_file(np.ones((1, 2))), headers=NPY), 422)
    assert client.get("/v1/fits?limit=1&offset=0").is_success
    several = client.post("/v1/evaluate?conditions=0&conditions=5", content=npy_file(np.ones((1, 2))), headers=NPY)
    assert several.json()["conditions"] == [0, 5]


@pytest.mark.parametrize(("path", "change"), [
    ("/v1/evaluate", {"points": [[True, 1.0]]}), ("/v1/evaluate", {"points": [["1.0", 1.0]]}),
    ("/v1/evaluate", {"conditions": [True]}), ("/v1/evaluate", {"conditions": ["0"]}),
    ("/v1/propagate", {"inputs": {**INPUTS, "mean": [True, "1.0"]}}), ("/v1/propagate", {"coefficients": 1}),
    ("/v1/propagate", {"inputs": {**INPUTS, "support": [["0", True], [0, 1]]}}),
    ("/v1/propagate", {"expansion": {"order": "3"}}), ("/v1/likelihood", {"seed": True}),
    ("/v1/fits", {"settings": {"population": "40"}}), ("/v1/fits", {"settings": {"output_std_bounds": ["0.1", 0.2]}}),
    ("/v1/fits", {"simulate": "no"}), ("/v1/studies", {"settings": {"level": "0.9"}}),
    ("/v1/studies", {"settings": {"seed": True}}), ("/v1/studies", {"settings": {"naming": {"most": "2"}}})])
def test_text_and_truth_values_are_no_numbers(client: httpx.Client, path: str, change: dict[str, Any]) -> None:
    found = problem(client.post(path, json={**POSTS.get(path, {}), **change}), 422)
    assert all(entry["where"].startswith("body.") for entry in found["errors"])
    assert found["errors"]


@pytest.mark.parametrize(("lines", "status"), [(17, 422), (32, 200)])
def test_the_number_of_lines_is_a_power_of_two(client: httpx.Client, lines: int, status: int) -> None:
    answer = client.post("/v1/likelihood", json={**POSTS["/v1/likelihood"], "lines": lines})
    assert answer.status_code == status
    if status == 422:
        assert "not a power of two" in answer.json()["errors"][0]["what"]


def test_a_fit_of_more_unknowns_than_engagements_is_refused(client: httpx.Client) -> None:
    client.post("/v1/recordings?name=two-only&bench=heavy", content=TWO, headers=CSV).raise_for_status()
    refused = client.post("/v1/fits", json={"recordings": "two-only"})
    assert problem(refused, 422)["detail"].startswith("2 engagements cannot determine 5 unknowns: mean of ")
    accepted = client.post("/v1/fits", json={"recordings": "measured"}, headers={"Idempotency-Key": "enough"})
    assert accepted.status_code == 202
    client.post("/v1/fits/enough/cancel")


def test_a_message_quotes_no_megabytes(client: httpx.Client) -> None:
    long = "x" * 1_000_000
    for path, body in (("/v1/evaluate", {"table": long, "points": [[1, 1]]}), ("/v1/fits", {"parameters": [long]}),
                       ("/v1/propagate", {"inputs": INPUTS, "bench": long})):
        answer = client.post(path, json=body)
        assert answer.is_client_error
        assert len(answer.content) < 5000, path
    assert "'nominl'" in client.get("/v1/tables/nominl").json()["detail"]
    assert str(UnknownName.of("table", "x", [str(number) for number in range(60)])).endswith("and 10 more.")
    assert len(str(UnknownName.of("table", "x", [str(number) for number in range(50)]))) < 300


def test_the_message_says_which_std_is_negative(client: httpx.Client) -> None:
    refused = client.post("/v1/propagate", json={"inputs": {"mean": [1, 1], "std": [0.1, -0.2]}})
    assert "std of input 1 is -0.2" in problem(refused, 422)["detail"]


@pytest.mark.parametrize("path", ["/v1", "/v1/health", "/v1/tables/nominal", "/docs", "/openapi.json"])
def test_head_is_get_without_the_body(client: httpx.Client, path: str) -> None:
    head, get = client.head(path), client.get(path)
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["Content-Length"] == get.headers["Content-Length"]
    assert head.headers["Content-Type"] == get.headers["Content-Type"]
    assert client.head("/v1/nothing").status_code == 404


def test_options_lists_the_methods(client: httpx.Client) -> None:
    for path, methods in (("/v1/health", "GET, HEAD, OPTIONS"), ("/v1/evaluate", "OPTIONS, POST")):
        answer = client.options(path)
        assert (answer.status_code, answer.content, answer.headers["Allow"]) == (204, b"", methods)
    assert client.options("/v1/nothing").status_code == 404


@pytest.mark.parametrize("sent", [b"\x16\x03\x01\x00\x00", b"GET /v1\r\n\r\n", b"GET /v1 HTTP/1.1\r\nHost\r\n\r\n",
                                  b"GET / HTTP/1.1\r\nHost: a\r\nX: " + b"x" * 70_000])
def test_what_is_no_request_is_a_problem_too(address: str, sent: bytes) -> None:
    host, port = address.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=20) as connection, connection.makefile("rb") as read:
        connection.sendall(sent)
        head, _, body = read.read().partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 400")
    assert b"application/problem+json" in head
    assert b'"type":"urn:slipstick:problem:malformed-request"' in body


def test_a_malformed_body_is_a_documented_response(client: httpx.Client) -> None:
    paths = client.get("/openapi.json").json()["paths"]
    for path in POSTS:
        assert client.post(path, content=b"{", headers={"Content-Type": "application/json"}).status_code == 400
        assert "400" in paths[path]["post"]["responses"]
    assert "400" not in paths["/v1/health"]["get"]["responses"]
