"""Jobs without a worker: their cost is limited, their place in the queue known, and ended ones can be deleted."""

import sqlite3
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from dbos import DBOSClient
from test_problems import problem

from service.fit_cost import fit_cost
from service.job_store import connect
from service.retention import remove_old
from service.settings import Settings
from slipstick.inference import table_problem
from slipstick.storage.library import Library
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


def test_old_jobs_are_removed_but_not_those_that_wait(client: httpx.Client, tmp_path: Path) -> None:
    ids = [client.post("/v1/fits", json={}).json()["id"] for _ in range(5)]
    for id in ids[:4]:
        client.post(f"/v1/fits/{id}/cancel")
    database = connect(f"sqlite:///{tmp_path}/jobs.sqlite")
    now = time.time()
    assert remove_old(database, 1, 10, now) == []
    assert remove_old(database, 1, 3, now) == [ids[0]]
    problem(client.get(f"/v1/fits/{ids[0]}"), 404)
    assert sorted(remove_old(database, 1, 10, now + 86_500)) == sorted(ids[1:4])
    assert [fit["id"] for fit in client.get("/v1/fits").json()["fits"]] == [ids[4]]
    database.destroy()


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
