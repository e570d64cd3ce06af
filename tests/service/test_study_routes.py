"""What the service does with studies by itself: here no worker is running, tests/worker has one."""

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
from service.study_schemas import ModelSpec, Studied, StudyProgress, StudySettingsBody
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings
from slipstick.study import study
from slipstick.study.comparison import compare
from slipstick.study.conclusion import conclude
from slipstick.study.evidence import evidence
from slipstick.study.progress import STAGES, progress
from slipstick.study.settings import StudySettings

KEY = {"Idempotency-Key": "mine"}
SETTINGS = {"catalogue": ["stribeck_friction", "centrifugal_pressure"], "shortlist": 2, "significance": 0.99,
            "smallest": 0.0, "most_effects": 1}
BODY = {"recordings": "few", "settings": SETTINGS}


@pytest.fixture
def alone(few_recordings: Path, shelf: Path, tmp_path: Path, serving) -> Iterator[httpx.Client]:
    shutil.copytree(shelf, tmp_path / "tables")
    shutil.copy(few_recordings / "few.h5", tmp_path / "tables")
    settings = Settings(tables=tmp_path / "tables", jobs=f"sqlite:///{tmp_path}/jobs.sqlite")
    with serving(settings) as address, httpx.Client(base_url=address, timeout=30) as client:
        yield client


@pytest.fixture(scope="module")
def steps(few_recordings: Path) -> list[study.State | None]:
    """The states of a study, None before the first."""
    settings, compared = task(few_recordings)
    states: list[study.State | None] = [None, study.start(settings, compared)]
    while not study.finished(states[-1]):
        states.append(study.advance(settings, compared, states[-1]))
    return states


@pytest.fixture(scope="module")
def output(few_recordings: Path, steps: list[study.State | None]) -> dict[str, Any]:
    """What the job of that study leaves, as JSON."""
    settings, compared = task(few_recordings)
    left = {"result": conclude(settings, compared, steps[-1]), "figure_data": evidence(settings, compared, steps[-1]),
            "seconds": {"fit": 2.0}, "processor_seconds": {"fit": 1.5}}
    found: dict[str, Any] = json.loads(json.dumps(left, allow_nan=False))
    return found


@pytest.fixture(scope="module")
def done(output: dict[str, Any], keeping, tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """A service whose store holds the study `done`."""
    order = {"recordings": "few", "recordings_digest": "c3d4",
             "settings": json.loads(json.dumps(asdict(StudySettings.from_dict(SETTINGS))))}
    with keeping(tmp_path_factory.mktemp("reports"), {"done": (order, output)}) as client:
        yield client


def task(few_recordings: Path) -> tuple[StudySettings, Any]:
    settings = StudySettings.from_dict(SETTINGS)
    return settings, compare(Recordings.open(few_recordings / "few.h5"), settings.shifting_time_noise)


def test_a_study_waits_for_the_worker_and_says_so(alone: httpx.Client) -> None:
    answer = alone.post("/v1/studies", json={"recordings": "few", "settings": {"shortlist": 3}})
    assert answer.status_code == 202
    waiting = alone.get(answer.headers["Location"]).json()
    assert (waiting["status"], waiting["progress"]) == ("queued", None)
    assert "serve-jobs" in waiting["note"]
    assert waiting["settings"]["shortlist"] == 3
    assert waiting["settings"]["catalogue"] == list(StudySettings().catalogue)
    health = alone.get("/v1/health").json()
    assert (health["studies_waiting"], health["fits_waiting"]) == (1, 0)
    assert [one["id"] for one in alone.get("/v1/studies").json()["studies"]] == [waiting["id"]]
    for part in ("result", "report", "pictures", "pictures/gap", "model"):
        assert alone.get(f"{waiting['links']['self']}/{part}").status_code == 409


def test_one_key_is_one_study_and_no_fit(alone: httpx.Client) -> None:
    answers = [alone.post("/v1/studies", json=BODY, headers=KEY) for _ in range(3)]
    assert {(answer.status_code, answer.json()["id"]) for answer in answers} == {(202, "mine")}
    assert len(alone.get("/v1/studies").json()["studies"]) == 1
    other = alone.post("/v1/studies", json={"recordings": "few"}, headers=KEY)
    assert (other.status_code, other.json()["title"]) == (409, "Conflict")
    assert alone.post("/v1/fits", json={}, headers=KEY).status_code == 409
    assert alone.get("/v1/fits/mine").status_code == 404
    alone.post("/v1/fits", json={}, headers={"Idempotency-Key": "fitted"})
    refused = alone.post("/v1/studies", json=BODY, headers={"Idempotency-Key": "fitted"})
    assert (refused.status_code, refused.json()["remedy"]) == (409, "Take another Idempotency-Key")


def test_a_waiting_study_can_be_cancelled_and_stays_so(alone: httpx.Client) -> None:
    alone.post("/v1/studies", json=BODY, headers=KEY)
    for _ in range(2):
        assert alone.post("/v1/studies/mine/cancel").json()["status"] == "cancelled"
    assert alone.post("/v1/studies", json=BODY, headers=KEY).json()["status"] == "cancelled"


@pytest.mark.parametrize(("body", "status", "said"), [
    ({"recordings": "fev"}, 404, "Did you mean 'few'?"),
    ({"settings": {"catalogue": ["stribek_friction"]}}, 404, "Did you mean 'stribeck_friction'?"),
    ({"settings": {"scatter": ["current_gain"], "parameters": ["pressure_bias"]}}, 404, "Known: pressure_bias"),
    ({"settings": {"significance": 1.5}}, 422, "between 0 and 1"),
    ({"settings": {"catalogue": []}}, 422, "Name one or more"),
    ({"settings": {"shifting_time_noise": -1}}, 422, "Give seconds"),
    ({"settings": {"short_list": 3}}, 422, "short_list"),
    ({"settings": {"seed": 1.5}}, 422, "seed"),
    ({"table": "nominal"}, 422, "table")])
def test_nonsense_is_refused_with_a_remedy(alone: httpx.Client, body: dict[str, Any], status: int, said: str) -> None:
    answer = alone.post("/v1/studies", json={"recordings": "few", **body})
    assert answer.status_code == status
    assert said in answer.json()["remedy"] + json.dumps(answer.json().get("errors"))
    assert not alone.get("/v1/studies").json()["studies"]


def test_a_signal_that_says_nothing_is_refused(alone: httpx.Client, tmp_path: Path) -> None:
    with h5py.File(tmp_path / "tables" / "few.h5", "r+") as file:
        file["signals/pressure"][...] = 1.0
    answer = alone.post("/v1/studies", json=BODY)
    assert (answer.status_code, answer.json()["detail"][:33]) == (422, "The signal pressure shows no nois")


def test_the_schemas_leave_out_nothing_that_a_study_knows(
        output: dict[str, Any], steps: list[study.State | None]) -> None:
    assert set(StudySettingsBody.model_fields) == {field.name for field in fields(StudySettings)}
    said = [progress(StudySettings.from_dict(SETTINGS), state) for state in steps]
    assert tuple(dict.fromkeys(one["stage"] for one in said)) == STAGES
    assert [one["candidate"] for one in said[2:4]] == ["stribeck_friction", "centrifugal_pressure"]
    assert [one["fitted"] for one in said if one["stage"] == "candidates"] == list(range(said[2]["candidates"]))
    assert said[-1]["added"] == ["stribeck_friction"]
    assert set(STAGES) == set(get_args(StudyProgress.model_fields["stage"].annotation))
    for one in said:
        assert json.loads(StudyProgress.model_validate(one).model_dump_json()) == one
    result = output["result"]
    assert json.loads(Studied.model_validate(result).model_dump_json()) == result
    assert ModelSpec(**result["models"]["after"]).model_dump() == result["models"]["after"]


def test_a_finished_study_is_served(done: httpx.Client, output: dict[str, Any]) -> None:
    found = done.get("/v1/studies/done").json()
    assert (found["status"], found["recordings"]) == ("done", "few")
    result = done.get(found["links"]["result"]).json()
    assert result["result"] == output["result"]
    assert result["seconds"] == {"fit": 2.0}
    model = Model.from_spec(done.get(found["links"]["model"]).json())
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
