"""Fits in the service without a running worker; tests/worker covers the worker."""

import json
import sqlite3
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from pathlib import Path

import httpx
import pytest

from service.fit_schemas import FitProgress, FitSettingsBody, FitSummary
from service.settings import Settings
from slipstick.inference import table_problem
from slipstick.storage.library import Library
from slipstick.uncertainty import fit

KEY = {"Idempotency-Key": "mine"}


@pytest.fixture
def client(shelf: Path, tmp_path: Path, serving) -> Iterator[httpx.Client]:
    settings = Settings(tables=shelf, jobs=f"sqlite:///{tmp_path}/jobs.sqlite")
    with serving(settings) as address, httpx.Client(base_url=address, timeout=30) as client:
        yield client


def test_a_fit_is_queued_with_a_note_about_the_worker(client: httpx.Client) -> None:
    response = client.post("/v1/fits", json={"settings": {"generations": 3}})
    assert response.status_code == 202
    fit = client.get(response.headers["Location"]).json()
    assert (fit["status"], fit["progress"]) == ("queued", None)
    assert "serve-jobs" in fit["note"]
    assert fit["settings"]["generations"] == 3
    assert fit["settings"]["population"] == 40
    assert client.get("/v1/health").json()["fits_waiting"] == 1
    assert client.get(f"/v1/fits/{fit['id']}/result").status_code == 409


def test_repeated_requests_with_one_key_create_one_fit(client: httpx.Client) -> None:
    body = {"settings": {"generations": 3}}
    with ThreadPoolExecutor(8) as pool:
        responses = list(pool.map(lambda _: client.post("/v1/fits", json=body, headers=KEY), range(24)))
    assert {(response.status_code, response.json()["id"]) for response in responses} == {(202, "mine")}
    assert len(client.get("/v1/fits").json()["fits"]) == 1
    other = client.post("/v1/fits", json={"settings": {"generations": 4}}, headers=KEY)
    assert other.status_code == 409
    assert client.get("/v1/fits/mine").json()["settings"]["generations"] == 3


def test_the_list_starts_with_the_newest_fit(client: httpx.Client) -> None:
    for name in ("b", "c", "a"):
        client.post("/v1/fits", json={}, headers={"Idempotency-Key": name})
        time.sleep(1.1)  # on Python 3.11 DBOS orders fits by whole seconds
    assert [fit["id"] for fit in client.get("/v1/fits").json()["fits"]] == ["a", "c", "b"]
    listed = client.get("/v1/fits", params={"limit": 1, "offset": 1}).json()["fits"]
    assert [fit["id"] for fit in listed] == ["c"]


def test_a_queued_fit_can_be_cancelled_and_stays_cancelled(client: httpx.Client) -> None:
    client.post("/v1/fits", json={}, headers=KEY)
    for _ in range(2):
        assert client.post("/v1/fits/mine/cancel").json()["status"] == "cancelled"
    assert client.get("/v1/fits/mine").json()["status"] == "cancelled"
    assert client.post("/v1/fits", json={}, headers=KEY).json()["status"] == "cancelled"


def test_a_broken_database_is_reported(client: httpx.Client, tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "jobs.sqlite") as database:
        database.execute("ALTER TABLE workflow_status RENAME TO elsewhere")
    for path in ("/v1/fits", "/v1/fits/mine", "/v1/health"):
        response = client.get(path)
        assert (response.status_code, response.json()["type"]) == (503, "urn:slipstick:problem:store-unavailable")
    assert client.get("/v1/tables").status_code == 200


def test_the_schemas_cover_all_fields_of_a_fit(shelf: Path) -> None:
    library = Library(shelf)
    problem = table_problem(library.table("nominal"), library.recording("measured"), "clip")
    settings = fit.FitSettings(population=4, generations=1, refine=False, intervals=False)
    state = fit.next_state(settings, problem, fit.initial_state(settings, problem))
    assert set(FitSettingsBody.model_fields) == {field.name for field in fields(fit.FitSettings)}
    assert set(FitProgress.model_fields) == {*fit.progress(settings, problem, state), "stage", "model_runs", "done",
                                             "seconds_left"}
    result = fit.summary(settings, problem, state, fit.refined_estimate(settings, problem, state))
    assert json.loads(FitSummary.model_validate(result).model_dump_json()) == json.loads(json.dumps(result))
