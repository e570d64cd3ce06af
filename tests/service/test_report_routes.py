"""Report and pictures of fits over HTTP, and which fits the report of a study accepts."""

import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.pictures import CAPTIONS
from slipstick.report import page
from slipstick.table import Axis, Grid
from slipstick.uncertainty.fit import FitSettings
from tests.benches import HEAVY, NOMINAL

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
    fields = JOB_INPUT | {"id": "done", "submitted": "2026-09-21T14:13:20Z", "ended": None,
                          "links": {"self": "/v1/fits/done"}}
    assert answer.text == page(fields, made())
    assert 'href="../../../"' in answer.text


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


# The report of a study accepts two comparable fits of its models and rejects others with a remedy.


BEFORE, AFTER = NOMINAL, NOMINAL.with_effect("stribeck_friction", {"strength": 0.2})
OF_STUDY = {"recordings": "mine", "recordings_digest": "c3d4", "simulate": False, "parameters": ["pressure_bias"],
             "outside": "clip", "settings": {"seed": 1}}


def table(model: Model) -> Grid:
    axis = Axis("pressure_bias", np.array([0.9, 1.1]), 1.6, "bar")
    return Grid((axis,), np.ones((2, 1)), np.zeros((2, 1), np.uint8), HEAVY.conditions.take([0]), model, "the tests")


@pytest.fixture(scope="module")
def studies(serving_jobs, tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """A service with tables of both models and a job store that contains studies and fits."""
    folder = tmp_path_factory.mktemp("tables")
    tables = {"before": table(BEFORE), "after": table(AFTER)}
    for name, grid in tables.items():
        grid.save(folder / f"{name}.h5")
    before, after = (OF_STUDY | {"table": name, "table_digest": grid.digest} for name, grid in tables.items())
    extended, unchanged = (
        {"result": {"before": {"model": BEFORE.spec()}, "after": {"model": model.spec()}, "gap": gap}}
        for model, gap in ((AFTER, {}), (BEFORE, None)))
    jobs = {"study": (OF_STUDY, extended), "none": (OF_STUDY, unchanged), "open": (OF_STUDY, None),
            "before": (before, unchanged), "after": (after, unchanged), "running": (after, None),
            "foreign": (after | {"recordings_digest": "e5f6"}, unchanged),
            "stale": (after | {"table_digest": "old"}, unchanged),
            "gone": (after | {"table": "gone", "table_digest": "old"}, unchanged),
            "other seed": (after | {"settings": {"seed": 2}}, unchanged),
            "simulated": (after | {"simulate": True}, unchanged)}
    with serving_jobs(folder, jobs) as studies:
        yield studies


@pytest.mark.parametrize("part", ["report", "pictures", "pictures/surfaces"])
@pytest.mark.parametrize(("study", "before", "after", "status", "remedy"), [
    ("study", "before", "afte", 404, "GET /v1/fits returns"),
    ("study", "before", "running", 409, "when its status is `done`"),
    ("open", "before", "after", 409, "when its status is `done`"),
    ("study", "before", None, 422, "Give both, or neither"),
    ("study", None, "after", 422, "Give both, or neither"),
    ("none", "before", "after", 422, "Omit `before` and `after`"),
    ("study", "before", "foreign", 422, "Fit the table to the recordings 'mine'"),
    ("study", "before", "stale", 422, "Submit the fit again"),
    ("study", "before", "gone", 404, "Known: after, before"),
    ("study", "after", "before", 422, "Build a table from /v1/studies/study/model?which=before"),
    ("study", "before", "before", 422, "Build a table from /v1/studies/study/model?which=after"),
    ("study", "before", "other seed", 422, "Submit the same fit on both tables"),
    ("study", "before", "simulated", 422, "Submit the same fit on both tables")])
def test_fits_that_do_not_belong_to_the_study_are_rejected_with_a_remedy(
        studies: httpx.Client, part: str, study: str, before: str | None, after: str | None, status: int,
        remedy: str) -> None:
    named = {which: fit for which, fit in (("before", before), ("after", after)) if fit}
    response = studies.get(f"/v1/studies/{study}/{part}", params=named)
    assert (response.status_code, remedy in response.json()["remedy"]) == (status, True), response.text
