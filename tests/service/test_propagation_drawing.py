"""Propagations as pictures and pages over HTTP."""

import httpx
import pytest

BODY = {"inputs": {"mean": [1.0, 1.0], "std": [0.05, 0.08]}, "conditions": [0, 215]}


@pytest.mark.parametrize(("form", "media_type", "start"), [
    ("svg", "image/svg+xml", b"<svg role=\"img\""), ("png", "image/png", b"\x89PNG"),
    ("html", "text/html; charset=utf-8", b"<!doctype html>"), ("json", "application/json", b"{")])
def test_the_same_request_is_drawn(client: httpx.Client, form: str, media_type: str, start: bytes) -> None:
    by_query = client.post(f"/v1/propagate?format={form}", json=BODY)
    by_header = client.post("/v1/propagate", json=BODY, headers={"Accept": media_type.split(";")[0]})
    for answer in (by_query, by_header):
        assert answer.status_code == 200
        assert answer.headers["Content-Type"] == media_type
        assert "Accept" in answer.headers["Vary"].split(", ")
    assert by_query.content.startswith(start)
    assert by_query.content == by_header.content


def test_the_page_has_the_numbers_of_the_answer(client: httpx.Client) -> None:
    numbers = client.post("/v1/propagate", json=BODY).json()
    assert client.post("/v1/propagate", json=BODY, headers={"Accept": "*/*"}).json() == numbers
    page = client.post("/v1/propagate?format=html", json=BODY).text
    for one in numbers["conditions"]:
        assert f">{1e3 * one['mean']:.1f}</td>" in page
        assert f">{100 * one['total'][0]:.0f} %</td>" in page
    assert "215: profile 5, motor" in page


def test_without_output_noise_there_is_no_density_but_a_picture(client: httpx.Client) -> None:
    assert client.post("/v1/propagate?format=svg", json={**BODY, "output_std": 0}).status_code == 200


def test_many_conditions_and_unknown_forms_are_refused(client: httpx.Client) -> None:
    answer = client.post("/v1/propagate?format=svg", json={"inputs": BODY["inputs"]})
    assert (answer.status_code, answer.json()["remedy"]) == (413, "Select conditions, or request JSON")
    assert client.post("/v1/propagate?format=pdf", json=BODY).status_code == 422


def test_the_forms_are_documented(client: httpx.Client) -> None:
    operation = client.get("/openapi.json").json()["paths"]["/v1/propagate"]["post"]
    assert operation["responses"]["200"]["content"].keys() == {
        "application/json", "text/csv", "image/svg+xml", "image/png", "text/html"}
    assert "`html` for a page" in operation["parameters"][0]["description"]
