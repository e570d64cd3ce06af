"""Invalid requests are answered by problem details with a remedy, never by an unhandled error."""

import io
import json
import socket
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest

from service import npy
from service.problem_details import MEDIA_TYPE, ProblemDetails

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
@pytest.mark.parametrize("media_type", ["application/x-www-form-urlencoded", "text/plain", None])
def test_a_body_of_the_wrong_media_type(client: httpx.Client, path: str, media_type: str | None) -> None:
    request = client.build_request("POST", path, content=json.dumps(POSTS[path]))
    if media_type:
        request.headers["Content-Type"] = media_type
    assert "--json" in problem(client.send(request), 415)["remedy"]


@pytest.mark.parametrize("path", POSTS)
@pytest.mark.parametrize("body", ["null", "[]", "3", '"x"', '{"tabel": "nominal"}', '{"table": 3}', '{"outside": "x"}'])
def test_json_that_does_not_match_the_schema(client: httpx.Client, path: str, body: str) -> None:
    assert problem(client.post(path, content=body, headers=JSON), 422)["errors"]


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


@pytest.mark.parametrize("path", ["/v1/fits?limit=0", "/v1/fits?offset=x", "/v1/fits/bad%20id"])
def test_invalid_parameters_of_the_address(client: httpx.Client, path: str) -> None:
    problem(client.get(path), 422)


def test_the_error_for_an_unsupported_method_names_the_supported_ones(client: httpx.Client) -> None:
    response = client.delete("/v1/fits")
    assert "GET, HEAD, OPTIONS, POST" in problem(response, 405)["remedy"]
    assert response.headers["Allow"] == "GET, HEAD, OPTIONS, POST"


def test_the_number_of_listed_validation_errors_is_limited(client: httpx.Client) -> None:
    content = problem(client.post("/v1/evaluate", json={"points": [["x", "y"]] * 50_000, "conditions": [0]}), 422)
    assert len(content["errors"]) == 20
    assert content["errors_left_out"] == 100_000 - 20


def test_query_parameters_with_a_json_body_are_rejected(client: httpx.Client) -> None:
    problem(client.post("/v1/evaluate?table=nominal", json=POSTS["/v1/evaluate"]), 422)


def test_responses_and_computations_beyond_the_limits_are_rejected(client: httpx.Client) -> None:
    points = {"points": [[1.0, 1.0]] * 500}
    assert "npy" in problem(client.post("/v1/evaluate", json=points), 413)["remedy"]
    as_array = {"Accept": npy.MEDIA_TYPE}
    assert np.load(io.BytesIO(client.post("/v1/evaluate", json=points, headers=as_array).content)).shape == (500, 216)
    problem(client.post("/v1/evaluate", json={"points": [[1.0, 1.0]] * 2000}, headers=as_array), 413)
    problem(client.post("/v1/propagate", json={"inputs": INPUTS, "density_points": 2000}), 413)
    many = [{**INPUTS, "output_std": 0.01}] * 100
    problem(client.post("/v1/likelihood", json={"method": "sampling", "samples": 1 << 17, "candidates": many}), 413)


@pytest.mark.parametrize("chunked", [False, True])
def test_a_body_beyond_the_limit_is_rejected(client: httpx.Client, chunked: bool) -> None:
    def parts() -> Iterator[bytes]:
        yield from [b" " * (1 << 20)] * 9

    body: Any = parts() if chunked else b" " * (9 << 20)
    problem(client.post("/v1/evaluate", content=body, headers=JSON), 413)


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
