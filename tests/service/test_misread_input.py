"""Input that would be ignored or misread is refused, unexpected input is no internal error, and nothing is echoed."""

import socket
from typing import Any

import httpx
import numpy as np
import pytest
from test_problems import INPUTS, POSTS, npy_file, problem

from service import npy
from service.failures import UnexpectedErrors
from service.settings import Settings
from service.study_schemas import StudyRequest
from slipstick.errors import UnknownName

NPY = {"Content-Type": npy.MEDIA_TYPE}
CSV = {"Content-Type": "text/csv"}
TWO = ("current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]\n"
       "0,104.7197551,6,20,0.9\n0,104.7197551,6,50,0.95\n")


@pytest.mark.parametrize("kind", ["fits", "studies"])
@pytest.mark.parametrize(("offset", "status"), [(2**63, 422), (10**4000, 422), (2**53, 200)])
def test_an_offset_is_limited(client: httpx.Client, kind: str, offset: int, status: int) -> None:
    assert client.get(f"/v1/{kind}", params={"offset": str(offset)}).status_code == status


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


def test_numbers_and_lists_are_accepted() -> None:
    settings = StudyRequest.model_validate(
        {"settings": {"level": 0.8, "catalogue": ["return_spring"], "naming": {"most": 2}}}).settings
    assert (settings.level, settings.catalogue, settings.naming.most) == (0.8, ("return_spring",), 2)


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
