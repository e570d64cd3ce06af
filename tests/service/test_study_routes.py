"""Studies in the service without a running worker; tests/worker covers the worker."""

import json
import shutil
from collections.abc import Iterator
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, get_args

import h5py
import httpx
import pytest

from service.settings import Settings
from service.study_schemas import ModelSpec, StudyProgress, StudySettingsBody, StudySummary
from slipstick.clutch.model import Model
from slipstick.study import study
from slipstick.study.progress import STAGES, progress
from slipstick.study.settings import StudySettings
from tests.benches import HEAVY

KEY = {"Idempotency-Key": "mine"}
BODY = {"recordings": "few", "settings": {"significance": 0.99, "most_effects": 1}}


@pytest.fixture
def client(few_recordings: Path, shelf: Path, tmp_path: Path, serving) -> Iterator[httpx.Client]:
    shutil.copytree(shelf, tmp_path / "tables")
    shutil.copy(few_recordings / "few.h5", tmp_path / "tables")
    settings = Settings(tables=tmp_path / "tables", jobs=f"sqlite:///{tmp_path}/jobs.sqlite")
    with serving(settings) as address, httpx.Client(base_url=address, timeout=30) as client:
        yield client


@pytest.fixture(scope="module")
def steps(few_study: dict[str, Any]) -> list[study.State | None]:
    """The states of a study after each step; None before the first."""
    states: list[study.State | None] = few_study["states"]
    return states


@pytest.fixture(scope="module")
def output(few_study: dict[str, Any]) -> dict[str, Any]:
    """The output of the job of that study, as JSON."""
    stored: dict[str, Any] = few_study["output"]
    return stored


@pytest.fixture(scope="module")
def done(few_study: dict[str, Any], output: dict[str, Any], serving_jobs,
         tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """Client of a service whose job store contains the finished study `done`."""
    job_input = {"recordings": "few", "recordings_digest": "c3d4", "bench": "heavy", "bench_digest": HEAVY.digest,
                 "sensing_digest": HEAVY.sensing_digest,
                 "settings": json.loads(json.dumps(asdict(StudySettings.from_dict(few_study["settings"]))))}
    with serving_jobs(tmp_path_factory.mktemp("reports"), {"done": (job_input, output)}) as client:
        yield client


def test_a_study_is_queued_with_a_note_about_the_worker(client: httpx.Client) -> None:
    response = client.post("/v1/studies", json={"recordings": "few", "settings": {"shortlist": 3}})
    assert response.status_code == 202
    queued = client.get(response.headers["Location"]).json()
    assert (queued["status"], queued["progress"]) == ("queued", None)
    assert "serve-jobs" in queued["note"]
    assert queued["settings"]["shortlist"] == 3
    assert queued["settings"]["catalogue"] == list(StudySettings().catalogue)
    health = client.get("/v1/health").json()
    assert (health["studies_waiting"], health["fits_waiting"]) == (1, 0)
    assert [entry["id"] for entry in client.get("/v1/studies").json()["studies"]] == [queued["id"]]
    for part in ("result", "report", "pictures", "pictures/gap", "model"):
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


def test_a_queued_study_can_be_cancelled_and_stays_cancelled(client: httpx.Client) -> None:
    client.post("/v1/studies", json=BODY, headers=KEY)
    for _ in range(2):
        assert client.post("/v1/studies/mine/cancel").json()["status"] == "cancelled"
    assert client.post("/v1/studies", json=BODY, headers=KEY).json()["status"] == "cancelled"


@pytest.mark.parametrize(("body", "status", "message"), [
    ({"recordings": "fev"}, 404, "Did you mean 'few'?"),
    ({"settings": {"catalogue": ["stribek_friction"]}}, 404, "Did you mean 'stribeck_friction'?"),
    ({"settings": {"scatter": ["current_gain"], "parameters": ["pressure_bias"]}}, 404, "Known: pressure_bias"),
    ({"settings": {"significance": 1.5}}, 422, "between 0 and 1"),
    ({"settings": {"catalogue": []}}, 422, "Name one or more"),
    ({"settings": {"shifting_time_noise": -1}}, 422, "Give seconds"),
    ({"settings": {"short_list": 3}}, 422, "short_list"),
    ({"settings": {"seed": 1.5}}, 422, "seed"),
    ({"table": "nominal"}, 422, "table")])
def test_invalid_studies_are_rejected_with_a_remedy(
        client: httpx.Client, body: dict[str, Any], status: int, message: str) -> None:
    response = client.post("/v1/studies", json={"recordings": "few", **body})
    assert response.status_code == status
    assert message in response.json()["remedy"] + json.dumps(response.json().get("errors"))
    assert not client.get("/v1/studies").json()["studies"]


def test_a_constant_signal_is_rejected(client: httpx.Client, tmp_path: Path) -> None:
    with h5py.File(tmp_path / "tables" / "few.h5", "r+") as file:
        file["signals/pressure"][...] = 1.0
    response = client.post("/v1/studies", json=BODY)
    assert (response.status_code, response.json()["detail"][:33]) == (422, "The signal pressure shows no nois")


def test_the_schemas_cover_all_fields_of_a_study(
        few_study: dict[str, Any], output: dict[str, Any], steps: list[study.State | None]) -> None:
    assert set(StudySettingsBody.model_fields) == {field.name for field in fields(StudySettings)}
    reports = [progress(StudySettings.from_dict(few_study["settings"]), state) for state in steps]
    assert tuple(dict.fromkeys(report["stage"] for report in reports)) == STAGES
    assert [report["candidate"] for report in reports[2:4]] == ["stribeck_friction", "centrifugal_pressure"]
    assert [report["fitted"] for report in reports if report["stage"] == "candidates"] == list(
        range(reports[2]["candidates"]))
    assert reports[-1]["added"] == ["stribeck_friction"]
    assert set(STAGES) == set(get_args(StudyProgress.model_fields["stage"].annotation))
    for report in reports:
        assert json.loads(StudyProgress.model_validate(report).model_dump_json()) == report
    result = output["result"]
    assert json.loads(StudySummary.model_validate(result).model_dump_json()) == result
    assert ModelSpec(**result["models"]["after"]).model_dump(exclude_none=True) == result["models"]["after"]


def test_a_finished_study_is_served(done: httpx.Client, output: dict[str, Any]) -> None:
    job = done.get("/v1/studies/done").json()
    assert (job["status"], job["recordings"]) == ("done", "few")
    result = done.get(job["links"]["result"]).json()
    assert result["result"] == output["result"]
    assert result["seconds"] == {"fit": 2.0}
    model = Model.from_spec(done.get(job["links"]["model"]).json())
    assert list(model.effects) == ["stribeck_friction"]


def test_the_report_and_the_pictures_are_those_of_the_study(done: httpx.Client) -> None:
    report = done.get("/v1/studies/done/report")
    assert report.headers["Content-Type"] == "text/html; charset=utf-8"
    assert report.text == done.get("/v1/studies/done/report").text
    assert "lip-speed-dependent friction" in report.text
    listed = done.get("/v1/studies/done/pictures").json()["pictures"]
    assert "gap" in [entry["name"] for entry in listed]
    for entry in listed:
        spec = done.get(entry["href"]).json()
        assert spec["title"]["text"] == entry["title"]
    svg = done.get(listed[0]["href"], params={"format": "svg"})
    assert svg.content.startswith(b"<svg")
    unknown = done.get("/v1/studies/done/pictures/gapp")
    assert (unknown.status_code, "Did you mean 'gap'?" in unknown.json()["remedy"]) == (404, True)
