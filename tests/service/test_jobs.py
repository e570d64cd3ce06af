"""Fits and jobs without a worker: their cost is limited, their place in the queue known, ended ones can be deleted."""

import json
import shutil
import sqlite3
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from pathlib import Path

import httpx
import pytest
from dbos import DBOSClient
from test_problems import problem

from service.fit_cost import fit_cost
from service.fit_schemas import FitProgress, FitSettingsBody, FitSummary
from service.settings import Settings
from slipstick.inference.problems import table_problem
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.uncertainty import fit
from slipstick.uncertainty.fit import FitSettings
from worker import heartbeat


@pytest.fixture
def client(shelf: Path, tmp_path: Path, serving) -> Iterator[httpx.Client]:
    settings = Settings(tables=shelf, jobs=f"sqlite:///{tmp_path}/jobs.sqlite")
    with serving(settings) as address, httpx.Client(base_url=address, timeout=30) as client:
        yield client


@pytest.mark.parametrize(("body", "status"), [
    ({"simulate": True, "settings": {"population": 1000, "generations": 10_000}}, 413),
    ({"settings": {"population": 1000, "generations": 10_000}}, 413),
    ({"settings": {"population": 1000, "generations": 1000}}, 202),
    ({"simulate": True, "settings": {"population": 40, "generations": 80}}, 202),
    ({"settings": {"method": "classic", "grid": 8}}, 202),
    ({"settings": {"method": "classic", "grid": 40}}, 413)])
def test_the_cost_of_a_fit_is_limited(client: httpx.Client, body: dict, status: int) -> None:
    answer = client.post("/v1/fits", json=body)
    assert answer.status_code == status, answer.text
    assert len(client.get("/v1/fits").json()["fits"]) == (status == 202)
    if status == 413:
        assert "SLIPSTICK_FIT_VALUES" in problem(answer, 413)["remedy"]


def test_a_fit_is_refused_if_the_table_cannot_reach_the_measurements(shelf: Path, tmp_path: Path, serving) -> None:
    folder = shutil.copytree(shelf, tmp_path / "tables")
    measured = Recordings.open(folder / "measured.h5")
    too_short = replace(measured, measured_time=1e-3 * measured.measured_time, signals=None)
    (folder / "too-short.h5").write_bytes(too_short.to_bytes())
    settings = Settings(tables=folder, jobs=f"sqlite:///{tmp_path}/jobs.sqlite")
    with serving(settings) as address, httpx.Client(base_url=address, timeout=30) as client:
        refused = problem(client.post("/v1/fits", json={"table": "nominal", "recordings": "too-short"}), 422)
        assert not client.get("/v1/fits").json()["fits"]
    assert refused["detail"].startswith("The measured shifting time is 0.000")
    assert "that of the model at the bounds of pressure_bias, initial_position" in refused["detail"]
    assert refused["remedy"].startswith("Check the unit of the measured shifting time")


def test_the_cost_grows_with_candidates_runs_and_conditions(shelf: Path) -> None:
    library = Library(shelf)
    table, recordings = library.table("nominal"), library.recording("measured")
    measured = table_problem(table, recordings, "clip")
    settings = FitSettings(population=10, generations=10)
    assert fit_cost(settings, measured, False) == 100 * (25 + 5000) * 216
    assert fit_cost(settings, measured, True) == 100 * (25 * 370 + 5000) * 216
    classic = FitSettings(method="classic", grid=3, samples=1024)
    assert fit_cost(classic, measured, False) == 3**5 * 1024 * 216


def test_the_place_in_the_queue_is_known(client: httpx.Client, tmp_path: Path) -> None:
    long = {"settings": {"population": 1000, "generations": 1000}}
    jobs = [("/v1/fits", {}, 0), ("/v1/studies", {}, 0), ("/v1/fits", {}, 1), ("/v1/fits", long, 1)]
    for count, (address, body, ahead) in enumerate(jobs):  # short and long jobs have a queue each
        job = client.post(address, json=body, headers={"Idempotency-Key": f"job-{count}"}).json()
        assert (job["ahead"], job["started"]) == (ahead, None)
    client.post("/v1/fits/job-0/cancel")
    assert client.get("/v1/fits/job-0").json()["ahead"] is None
    assert client.get("/v1/fits/job-2").json()["ahead"] == 0
    assert client.get("/v1/fits/job-3").json()["ahead"] == 1


def test_only_ended_jobs_are_deleted(client: httpx.Client) -> None:
    for address in ("/v1/fits", "/v1/studies"):
        job = client.post(address, json={}).json()["links"]["self"]
        assert f"{job}/cancel" in problem(client.delete(job), 409)["remedy"]
        client.post(f"{job}/cancel")
        deleted = client.delete(job)
        assert (deleted.status_code, deleted.content) == (204, b"")
        problem(client.delete(job), 404)
        problem(client.get(job), 404)
    assert client.get("/v1/fits").json()["fits"] == []


def test_a_job_states_when_it_was_started(client: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    job = client.post("/v1/fits", json={}).json()
    listed = DBOSClient.list_workflows

    def running(*arguments: object, **options: object) -> list:
        jobs = listed(*arguments, **options)
        for one in jobs:
            one.status, one.dequeued_at = "PENDING", 1_790_000_000_000
        return jobs

    monkeypatch.setattr(DBOSClient, "list_workflows", running)
    assert client.get(job["links"]["self"]).json()["started"] == "2026-09-21T14:13:20Z"


def test_the_health_check_counts_the_workers_with_a_recent_heartbeat(client: httpx.Client, tmp_path: Path) -> None:
    assert client.get("/v1/health").json()["workers"] == 0
    with sqlite3.connect(tmp_path / "jobs.sqlite") as database:
        database.execute(heartbeat._CREATE)
        for name, age in (("alive", 1), ("dead", 6), ("stopped", time.time())):
            database.execute("INSERT INTO slipstick_workers VALUES (?, ?)", (name, time.time() - age))
    time.sleep(1.1)  # the health is at most a second old
    assert client.get("/v1/health").json()["workers"] == 1


# Fits in the service without a running worker; tests/worker covers the worker.


KEY = {"Idempotency-Key": "mine"}


def test_a_fit_is_queued_with_a_note_about_the_worker(client: httpx.Client) -> None:
    response = client.post("/v1/fits", json={"settings": {"generations": 3}})
    assert response.status_code == 202
    fit = client.get(response.headers["Location"]).json()
    assert (fit["status"], fit["progress"]) == ("queued", None)
    assert "work" in fit["note"]
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


def test_a_time_budget_makes_no_other_job_but_a_partial_result_is_not_used_again(
        client: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    assert client.post("/v1/fits", json={}, headers=KEY).json()["time_budget"] == 86_400
    assert client.post("/v1/fits", json={"time_budget": None}, headers=KEY).json()["time_budget"] == 86_400
    for budget in (0, -1.0, "1"):
        problem(client.post("/v1/fits", json={"time_budget": budget}), 422)
    listed, partial = DBOSClient.list_workflows, {"budget": 86_400.0, "done": [], "missing": ["refinement"]}

    def done(self: DBOSClient, *arguments: object, **options: object) -> list:
        """The first job as if it were done, with a partial result."""
        jobs = listed(self, *arguments, **options)
        for one in jobs:
            if one.input["args"][0]["time_budget"] == 86_400:
                one.status, one.output = "SUCCESS", {"result": {"partial": partial}}
        return jobs

    monkeypatch.setattr(DBOSClient, "list_workflows", done)
    refused = client.post("/v1/fits", json={"settings": {"generations": 4}}, headers=KEY)
    assert refused.status_code == 409
    again = client.post("/v1/fits", json={"time_budget": 60}, headers=KEY).json()
    assert (again["id"], again["status"], again["time_budget"]) == ("mine", "queued", 60)
    assert len(client.get("/v1/fits").json()["fits"]) == 1
    partial.clear()  # so that the result is complete
    assert client.post("/v1/fits", json={}, headers={"Idempotency-Key": "complete"}).json()["time_budget"] == 86_400
    assert client.post("/v1/fits", json={"time_budget": 60}, headers={"Idempotency-Key": "complete"}
                       ).json()["time_budget"] == 86_400


def test_a_queued_fit_can_be_cancelled_and_stays_cancelled(client: httpx.Client) -> None:
    client.post("/v1/fits", json={}, headers=KEY)
    cancelled = client.post("/v1/fits/mine/cancel").json()
    assert cancelled["status"] == "cancelled"
    time.sleep(1.1)  # times of jobs are in whole seconds
    assert client.post("/v1/fits/mine/cancel").json() == cancelled
    assert client.get("/v1/fits/mine").json() == cancelled
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
                                             "seconds_left", "budget_left"}
    result = fit.summary(settings, problem, state, fit.refined_estimate(settings, problem, state))
    assert json.loads(FitSummary.model_validate(result).model_dump_json()) == json.loads(json.dumps(result))
