"""Studies in the service without a running worker; tests/worker covers the worker."""

import csv
import io
import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import h5py
import httpx
import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy.io import loadmat

from service.settings import Settings
from service.study_schemas import ModelSpec
from slipstick.clutch.model import Model
from slipstick.studies import StudyResult, StudySettings
from tests.benches import HEAVY
from tests.service.conftest import Serving

KEY = {"Idempotency-Key": "mine"}
BODY = {"recordings": "few", "settings": {"level": 0.95}}
SINGLE = {"title": "Lag", "law": {
    "x": None, "x_unit": "", "change": [0.01], "lower": [0.0], "upper": [0.02], "unit": "s", "relative": False,
    "up_to": "nothing", "linearised": False, "formula": None}}


@contextmanager
def serving_few(serving: Serving, shelf: Path, few_recordings: Path, folder: Path) -> Iterator[httpx.Client]:
    shutil.copytree(shelf, folder / "tables")
    shutil.copy(few_recordings / "few.h5", folder / "tables")
    settings = Settings(tables=folder / "tables", jobs=f"sqlite:///{folder}/jobs.sqlite")
    with serving(settings) as address, httpx.Client(base_url=address, timeout=30) as client:
        yield client


@pytest.fixture
def client(serving: Serving, shelf: Path, few_recordings: Path, tmp_path: Path) -> Iterator[httpx.Client]:
    with serving_few(serving, shelf, few_recordings, tmp_path) as client:
        yield client


@pytest.fixture(scope="module")
def refusing(serving: Serving, shelf: Path, few_recordings: Path, tmp_path_factory: pytest.TempPathFactory
             ) -> Iterator[httpx.Client]:
    """A client for requests that are all refused, which leave nothing behind."""
    with serving_few(serving, shelf, few_recordings, tmp_path_factory.mktemp("refusing")) as client:
        yield client


@pytest.fixture(scope="module")
def done(few_study: dict[str, Any], serving_jobs, tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """Client of a service whose job store has the finished study `done`, and `lag` whose second finding is a lag."""
    job_input = {"recordings": "few", "recordings_digest": "c3d4", "bench": "heavy", "bench_digest": HEAVY.digest,
                 "sensing_digest": HEAVY.sensing_digest,
                 "settings": json.loads(json.dumps(asdict(StudySettings())))}
    first, = few_study["result"]["findings"]
    lag = few_study | {"result": few_study["result"] | {"findings": [first | {"law": None}, first | SINGLE]}}
    with serving_jobs(tmp_path_factory.mktemp("reports"),
                      {"done": (job_input, few_study), "lag": (job_input, lag)}) as client:
        yield client


def test_a_study_is_queued_with_a_note_about_the_worker(client: httpx.Client) -> None:
    settings = {"level": 0.8, "naming": {"most": 2}}
    response = client.post("/v1/studies", json={"recordings": "few", "settings": settings})
    assert response.status_code == 202
    queued = client.get(response.headers["Location"]).json()
    assert (queued["status"], queued["progress"]) == ("queued", None)
    assert "work" in queued["note"]
    assert queued["settings"] == json.loads(json.dumps(asdict(StudySettings.from_dict(settings))))
    health = client.get("/v1/health").json()
    assert (health["studies_waiting"], health["fits_waiting"]) == (1, 0)
    assert [entry["id"] for entry in client.get("/v1/studies").json()["studies"]] == [queued["id"]]
    for part in ("result", "report", "pictures", "pictures/gap", "model", "laws", "laws/0"):
        assert client.get(f"{queued['links']['self']}/{part}").status_code == 409


def test_repeated_requests_with_one_key_create_one_study_and_no_fit(client: httpx.Client) -> None:
    responses = [client.post("/v1/studies", json=BODY, headers=KEY) for _ in range(3)]
    assert {(response.status_code, response.json()["id"]) for response in responses} == {(202, "mine")}
    assert len(client.get("/v1/studies").json()["studies"]) == 1
    other = client.post("/v1/studies", json={"recordings": "few"}, headers=KEY)
    assert (other.status_code, other.json()["title"]) == (409, "Conflict")
    assert client.post("/v1/fits", json={}, headers=KEY).status_code == 409
    assert client.get("/v1/fits/mine").status_code == 404
    client.post("/v1/fits", json={}, headers={"Idempotency-Key": "fitted"})
    response = client.post("/v1/studies", json=BODY, headers={"Idempotency-Key": "fitted"})
    assert (response.status_code, response.json()["remedy"]) == (409, "Use a different Idempotency-Key")


@pytest.mark.parametrize(("body", "status", "message"), [
    ({"recordings": "fev"}, 404, "Did you mean 'few'?"),
    ({"settings": {"catalogue": ["stribek_friction"]}}, 404, "Did you mean 'stribeck_friction'?"),
    ({"settings": {"catalogue": ["thermal_fade"] * 2}}, 422, "each once"),
    ({"settings": {"level": 1.5}}, 422, "between 0 and 1"),
    ({"settings": {"naming": {"nats": -1}}}, 422, "Give a number of 0 or more"),
    ({"settings": {"levels": 0.9}}, 422, "body.settings.levels"),
    ({"settings": {"naming": {"nat": 9}}}, 422, "body.settings.naming.nat"),
    ({"settings": {"seed": 2**60}}, 422, "whole number from 0"),
    ({"table": "nominal"}, 422, "body.table")])
def test_invalid_studies_are_rejected_with_a_remedy(
        refusing: httpx.Client, body: dict[str, Any], status: int, message: str) -> None:
    response = refusing.post("/v1/studies", json={"recordings": "few", **body})
    assert response.status_code == status
    assert message in response.json()["remedy"] + json.dumps(response.json().get("errors"))
    assert not refusing.get("/v1/studies").json()["studies"]


def test_recordings_that_cannot_be_studied_are_rejected(client: httpx.Client, tmp_path: Path) -> None:
    path = tmp_path / "tables" / "few.h5"

    def refused() -> str:
        response = client.post("/v1/studies", json=BODY)
        assert response.status_code == 422
        return str(response.json()["detail"])

    with h5py.File(path, "r+") as file:
        pressure = file["signals/pressure"][:]
        file["signals/pressure"][...] = 1.0
    assert refused().startswith("The signal pressure shows no noise")
    with h5py.File(path, "r+") as file:
        file["signals/pressure"][...] = pressure
        for name in [*(f"conditions/{name}" for name in file["conditions"]), "shifting_time",
                     *(f"signals/{name}" for name in file["signals"] if name != "time")]:
            values, units = file[name][:23], file[name].attrs["units"]
            del file[name]
            file[name] = np.arange(23) if name.endswith("run_order") else values
            file[name].attrs["units"] = units
    assert refused().startswith("23 engagements are too few")
    with h5py.File(path, "r+") as file:
        del file["signals"]
    assert refused().startswith("23 engagements are too few")
    assert not client.get("/v1/studies").json()["studies"]


def test_a_finished_study_is_served(done: httpx.Client, few_study: dict[str, Any]) -> None:
    job = done.get("/v1/studies/done").json()
    assert (job["status"], job["recordings"]) == ("done", "few")
    result = done.get(job["links"]["result"]).json()
    assert result["result"] == few_study["result"]
    assert result["seconds"] == few_study["seconds"]
    assert asdict(TypeAdapter(StudyResult).validate_python(result["result"])) == few_study["result"]
    for which, effects in (("before", []), ("after", ["stribeck_friction"])):
        spec = done.get(job["links"]["model"], params={"which": which}).json()
        assert spec == few_study["result"][which]["model"]
        assert ModelSpec(**spec).model_dump(exclude_none=True) == spec
        assert list(Model.from_spec(spec).effects) == effects


def test_the_measured_laws_are_served_as_json_and_as_files(done: httpx.Client, few_study: dict[str, Any]) -> None:
    finding, = few_study["result"]["findings"]
    law = finding["law"]
    entry, = done.get(done.get("/v1/studies/done").json()["links"]["laws"]).json()["laws"]
    assert entry["law"] == law
    assert (entry["finding"], entry["effect"], entry["depends_on"]) == (0, "stribeck_friction", "slip")
    assert done.get(entry["links"]["json"]).json() == entry
    file = done.get(entry["links"]["csv"])
    assert file.headers["Content-Type"] == "text/csv; charset=utf-8"
    assert 'filename="done_0_friction_coefficient_over_slip.csv"' in file.headers["Content-Disposition"]
    heading, *rows = csv.reader(io.StringIO(file.text))
    assert heading == ["slip [rad/s]", "friction_coefficient_relative_change [1]", "lower [1]", "upper [1]",
                       "formula [1]"]
    columns = [law[name] for name in ("x", "change", "lower", "upper", "formula")]
    assert np.array_equal(np.array(rows, float).T, columns)
    content = loadmat(io.BytesIO(done.get(entry["links"]["mat"]).content), simplify_cells=True)
    for head, column in zip(heading, columns, strict=True):
        name, unit = head.removesuffix("]").split(" [")
        assert np.array_equal(content[name], column)
        assert content[f"{name}_unit"] == unit
    assert (content["quantity"], content["known_up_to"], content["relative"]) == (
        "friction coefficient", law["up_to"], law["relative"])
    assert entry["equation"].startswith("friction coefficient = alpha (1 + 0.")
    for suffix, media_type, part in (("mo", "text/x-modelica; charset=utf-8", "block friction_coefficient_over_slip "),
                                     ("h", "text/x-chdr; charset=utf-8", "double friction_coefficient_over_slip_change("
                                      )):
        file = done.get(entry["links"][suffix])
        assert file.headers["Content-Type"] == media_type
        assert f'filename="done_0_friction_coefficient_over_slip.{suffix}"' in file.headers["Content-Disposition"]
        assert part in file.text
        assert f"// Named effect: {entry['equation']}.\n" in file.text


def test_a_law_without_points_is_no_file_and_a_finding_without_law_has_none(done: httpx.Client) -> None:
    entry, = done.get("/v1/studies/lag/laws").json()["laws"]
    assert (entry["finding"], entry["law"]["change"], list(entry["links"])) == (1, [0.01], ["json"])
    refused = done.get("/v1/studies/lag/laws/1", params={"format": "mat"})
    assert (refused.status_code, "is a single number" in refused.json()["detail"]) == (422, True)
    for index in (0, 2):
        unknown = done.get(f"/v1/studies/lag/laws/{index}")
        assert (unknown.status_code, unknown.json()["remedy"]) == (404, "Known: 1")


def test_the_report_and_the_pictures_are_those_of_the_study(done: httpx.Client, few_study: dict[str, Any]) -> None:
    report = done.get("/v1/studies/done/report")
    assert report.headers["Content-Type"] == "text/html; charset=utf-8"
    assert report.text == done.get("/v1/studies/done/report").text
    assert few_study["result"]["sentence"].removeprefix("Missing: ") in report.text
    listed = done.get("/v1/studies/done/pictures").json()["pictures"]
    assert "gap" in [entry["name"] for entry in listed]
    for entry in listed:
        spec = done.get(entry["href"]).json()
        assert spec["title"]["text"] == entry["title"]
    svg = done.get(listed[0]["href"], params={"format": "svg"})
    assert svg.content.startswith(b"<svg")
    unknown = done.get("/v1/studies/done/pictures/gapp")
    assert (unknown.status_code, "Did you mean 'gap'?" in unknown.json()["remedy"]) == (404, True)
