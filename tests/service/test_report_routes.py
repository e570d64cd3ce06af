"""Report and pictures of fits over HTTP; the fits are put into the job store without running them."""

import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import httpx
import pytest

from slipstick.pictures import CAPTIONS
from slipstick.report import page
from slipstick.uncertainty.fit import FitSettings

ServingJobs = Callable[[Path, dict[str, Any]], AbstractContextManager[httpx.Client]]
JOB_INPUT = {"table": "nominal", "table_digest": "a1b2", "recordings": "measured", "recordings_digest": "c3d4",
             "simulate": False, "parameters": ["pressure_bias", "initial_position"], "outside": "clip",
             "bench": None, "bench_digest": None, "sensing_digest": None,
             "settings": json.loads(json.dumps(FitSettings(seed=7).to_dict()))}


@pytest.fixture(scope="module")
def client(made: Callable[..., dict[str, Any]], serving_jobs: ServingJobs,
           tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    classic = made()
    classic["result"]["method"] = "classic"
    bounded = JOB_INPUT["settings"] | {"std_bounds": [[0.01, 0.1]]}
    fits = {"done": (JOB_INPUT, made()), "classic": (JOB_INPUT, classic), "running": (JOB_INPUT, None),
            "foreign": (JOB_INPUT | {"recordings_digest": "e5f6"}, classic),
            "bounded": (JOB_INPUT | {"settings": bounded}, classic),
            "narrower": (JOB_INPUT | {"parameters": ["pressure_bias"]}, classic)}
    with serving_jobs(tmp_path_factory.mktemp("reports"), fits) as client:
        yield client


def test_the_report_is_the_page_of_the_fit(client: httpx.Client, made: Callable[..., dict[str, Any]]) -> None:
    answer = client.get("/v1/fits/done/report")
    assert answer.status_code == 200
    assert answer.headers["Content-Type"] == "text/html; charset=utf-8"
    assert "fitted to 216 engagements of “measured”" in answer.text
    assert answer.text == client.get("/v1/fits/done/report").text
    fields = JOB_INPUT | {"id": "done", "submitted": "2026-09-21T14:13:20Z", "ended": None}
    assert answer.text == page(fields, made())


def test_a_fit_by_the_other_method_completes_table_ii(client: httpx.Client) -> None:
    assert "Only one method was run here" in client.get("/v1/fits/done/report").text
    assert "Only one method was run here" not in client.get("/v1/fits/done/report?beside=classic").text
    for other in ("done", "foreign", "narrower", "bounded"):
        answer = client.get(f"/v1/fits/done/report?beside={other}")
        assert (answer.status_code, answer.json()["type"]) == (422, "urn:slipstick:problem:invalid-value")


def test_pictures_are_listed_with_their_captions(client: httpx.Client) -> None:
    listed = client.get("/v1/fits/done/pictures").json()["pictures"]
    assert {entry["name"]: entry["caption"] for entry in listed} == CAPTIONS
    for entry in listed:
        spec = client.get(entry["href"]).json()
        assert spec["$schema"].endswith("/vega-lite/v5.json")
        assert spec["title"]["text"] == entry["title"]


@pytest.mark.parametrize(("accept", "media_type", "start"), [
    ("*/*", "application/json", b"{"),
    ("", "application/json", b"{"),
    ("text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8", "application/json", b"{"),
    ("image/avif,image/webp,image/apng,image/svg+xml,image/*,*/*;q=0.8", "image/svg+xml", b"<svg"),
    ("application/json;q=0.5, image/png", "image/png", b"\x89PNG"),
    ("application/json; q=0.5, image/png;q=0.4", "application/json", b"{")])
def test_the_accept_header_selects_the_format(client: httpx.Client, accept: str, media_type: str, start: bytes) -> None:
    answer = client.get("/v1/fits/done/pictures/profiles", headers={"Accept": accept})
    assert answer.headers["Content-Type"].startswith(media_type)
    assert "Accept" in answer.headers["Vary"].split(", ")
    assert answer.content.startswith(start)


def test_the_format_query_overrides_the_accept_header(client: httpx.Client) -> None:
    answer = client.get("/v1/fits/done/pictures/profiles?format=svg", headers={"Accept": "image/png"})
    assert answer.headers["Content-Type"].startswith("image/svg+xml")
    assert client.get("/v1/fits/done/pictures/profiles?format=pdf").status_code == 422


@pytest.mark.parametrize("resource", ["report", "pictures", "pictures/profiles"])
def test_an_unfinished_fit_is_a_conflict(client: httpx.Client, resource: str) -> None:
    assert client.get(f"/v1/fits/running/{resource}").status_code == 409
    assert client.get(f"/v1/fits/missing/{resource}").status_code == 404


def test_the_error_for_an_unknown_picture_suggests_the_nearest_name(client: httpx.Client) -> None:
    answer = client.get("/v1/fits/done/pictures/profile")
    assert answer.status_code == 404
    assert "Did you mean 'profiles'?" in answer.json()["remedy"]
