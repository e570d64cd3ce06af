"""What the service does with fits by itself: here no worker is running, tests/worker has one."""

import json
import sqlite3
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from pathlib import Path

import httpx
import pytest

from service.fit_schemas import Fitted, Progress, SearchSettings
from service.settings import Settings
from slipstick.inference import table_problem
from slipstick.storage.library import Library
from slipstick.uncertainty import fit

KEY = {"Idempotency-Key": "mine"}


@pytest.fixture
def alone(shelf: Path, tmp_path: Path, serving) -> Iterator[httpx.Client]:
    settings = Settings(tables=shelf, jobs=f"sqlite:///{tmp_path}/jobs.sqlite")
    with serving(settings) as address, httpx.Client(base_url=address, timeout=30) as client:
        yield client


def test_a_fit_waits_for_the_worker_and_says_so(alone: httpx.Client) -> None:
    answer = alone.post("/v1/fits", json={"settings": {"generations": 3}})
    assert answer.status_code == 202
    fit = alone.get(answer.headers["Location"]).json()
    assert (fit["status"], fit["progress"]) == ("queued", None)
    assert "serve-jobs" in fit["note"]
    assert fit["settings"]["generations"] == 3
    assert fit["settings"]["population"] == 40
    assert alone.get("/v1/health").json()["fits_waiting"] == 1
    assert alone.get(f"/v1/fits/{fit['id']}/result").status_code == 409


def test_one_key_is_one_fit_however_often_it_is_sent(alone: httpx.Client) -> None:
    body = {"settings": {"generations": 3}}
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _: alone.post("/v1/fits", json=body, headers=KEY), range(24)))
    assert {(answer.status_code, answer.json()["id"]) for answer in answers} == {(202, "mine")}
    assert len(alone.get("/v1/fits").json()["fits"]) == 1
    other = alone.post("/v1/fits", json={"settings": {"generations": 4}}, headers=KEY)
    assert other.status_code == 409
    assert alone.get("/v1/fits/mine").json()["settings"]["generations"] == 3


def test_the_list_begins_with_the_newest(alone: httpx.Client) -> None:
    for name in ("b", "c", "a"):
        alone.post("/v1/fits", json={}, headers={"Idempotency-Key": name})
        time.sleep(1.1)  # Python 3.11 has DBOS tell fits apart by the second
    assert [fit["id"] for fit in alone.get("/v1/fits").json()["fits"]] == ["a", "c", "b"]
    listed = alone.get("/v1/fits", params={"limit": 1, "offset": 1}).json()["fits"]
    assert [fit["id"] for fit in listed] == ["c"]


def test_a_waiting_fit_can_be_cancelled_and_stays_so(alone: httpx.Client) -> None:
    alone.post("/v1/fits", json={}, headers=KEY)
    for _ in range(2):
        assert alone.post("/v1/fits/mine/cancel").json()["status"] == "cancelled"
    assert alone.get("/v1/fits/mine").json()["status"] == "cancelled"
    assert alone.post("/v1/fits", json={}, headers=KEY).json()["status"] == "cancelled"


def test_a_database_that_breaks_is_said(alone: httpx.Client, tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "jobs.sqlite") as database:
        database.execute("ALTER TABLE workflow_status RENAME TO elsewhere")
    for path in ("/v1/fits", "/v1/fits/mine", "/v1/health"):
        answer = alone.get(path)
        assert (answer.status_code, answer.json()["type"]) == (503, "urn:slipstick:problem:store-unavailable")
    assert alone.get("/v1/tables").status_code == 200


def test_the_schemas_leave_out_nothing_that_a_fit_knows(shelf: Path) -> None:
    library = Library(shelf)
    problem = table_problem(library.table("nominal"), library.recording("measured"), "clip")
    settings = fit.FitSettings(population=4, generations=1, refine=False, intervals=False)
    state = fit.next_state(settings, problem, fit.initial_state(settings, problem))
    assert set(SearchSettings.model_fields) == {field.name for field in fields(fit.FitSettings)}
    assert set(Progress.model_fields) == {*fit.progress(settings, problem, state), "stage", "model_runs"}
    result = fit.summary(settings, problem, state, fit.refined_estimate(settings, problem, state))
    assert json.loads(Fitted.model_validate(result).model_dump_json()) == json.loads(json.dumps(result))
