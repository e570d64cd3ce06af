"""Waiting for a job: `wait` and events end with the job, resume, have a limit, share reads, and end with the server."""

import json
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest
from test_problems import problem

from service.job_store import JobStore
from service.settings import Settings

KINDS = pytest.mark.parametrize("kind", ["fits", "studies"])


@pytest.fixture
def client(shelf: Path, tmp_path: Path, serving: Any) -> Iterator[httpx.Client]:
    settings = Settings(tables=shelf, jobs=f"sqlite:///{tmp_path}/jobs.sqlite", followers=3)
    with serving(settings) as address, httpx.Client(base_url=address, timeout=30) as client:
        yield client


def submitted(client: httpx.Client, kind: str = "fits") -> str:
    job: str = client.post(f"/v1/{kind}", json={}).json()["links"]["self"]
    return job


def events(lines: Iterator[str]) -> Iterator[dict[str, str]]:
    """The events of a stream, each with its fields; the retry time is one of its own."""
    event: dict[str, str] = {}
    for line in lines:
        if line:
            name, _, value = line.partition(": ")
            event[name] = value
        else:
            yield event
            event = {}


def test_wait_ends_with_the_job(client: httpx.Client) -> None:
    job = submitted(client)
    with ThreadPoolExecutor() as pool:
        waiting = pool.submit(client.get, job, params={"wait": 60})
        time.sleep(0.8)
        assert not waiting.done()
        assert client.get(job).json()["status"] == "queued"  # without `wait` at once
        client.post(f"{job}/cancel")
        assert waiting.result(timeout=10).json()["status"] == "cancelled"
    assert client.get(job, params={"wait": 1}).json()["status"] == "cancelled"


def test_wait_ends_after_its_time_and_is_limited(client: httpx.Client) -> None:
    job = submitted(client)
    assert client.get(job, params={"wait": 1}).json()["status"] == "queued"
    for wait in ("301", "-1", "1.5", "x"):
        problem(client.get(job, params={"wait": wait}), 422)
    problem(client.get("/v1/fits/none", params={"wait": 60}), 404)


@KINDS
def test_events_tell_each_change_end_by_themselves_and_resume(client: httpx.Client, kind: str) -> None:
    job = submitted(client, kind)
    with client.stream("GET", f"{job}/events") as stream:
        assert stream.headers["Content-Type"].startswith("text/event-stream")
        told = events(stream.iter_lines())
        assert next(told) == {"retry": "2000"}
        first = next(told)
        assert (first["event"], json.loads(first["data"])) == ("state", client.get(job).json())
        client.post(f"{job}/cancel")
        last, = told  # the end of the stream
    assert (last["event"], json.loads(last["data"])) == ("end", client.get(job).json())
    assert json.loads(last["data"])["status"] == "cancelled"

    def resumed(id: str) -> httpx.Response:
        return client.get(f"{job}/events", headers={"Last-Event-ID": id})

    assert [event.get("id") for event in events(iter(resumed(first["id"]).text.splitlines()))] == [None, last["id"]]
    assert (resumed(last["id"]).status_code, resumed(last["id"]).content) == (204, b"")
    problem(client.get(f"/v1/{kind}/none/events"), 404)


def test_a_deleted_job_ends_its_stream(client: httpx.Client) -> None:
    job = submitted(client)
    reading = threading.Event()

    def told() -> list[dict[str, str]]:
        with client.stream("GET", f"{job}/events") as stream:
            answer = events(stream.iter_lines())
            seen = [next(answer), next(answer)]
            reading.set()
            return [*seen, *answer]

    with ThreadPoolExecutor() as pool:
        waiting = pool.submit(told)
        assert reading.wait(10)
        client.post(f"{job}/cancel")
        client.delete(job)
        last = waiting.result(timeout=10)[-1]  # the cancellation may be seen before the deletion
    assert last["event"] in ("problem", "end")
    assert json.loads(last["data"])["status"] in (404, "cancelled")


def test_head_of_a_stream_ends_at_once(client: httpx.Client) -> None:
    assert client.head(f"{submitted(client)}/events").headers["Content-Type"].startswith("text/event-stream")


def test_waiting_has_a_limit_and_leaves_places_when_clients_go(client: httpx.Client) -> None:
    job = submitted(client)
    for _ in range(3):  # three times three: what leaves makes room
        streams = [client.stream("GET", f"{job}/events") for _ in range(3)]
        for stream in streams:
            assert stream.__enter__().status_code == 200
        assert "Retry-After" in client.get(job, params={"wait": 5}).headers
        problem(client.get(f"{job}/events"), 503)
        assert client.get(job).is_success
        assert client.post("/v1/evaluate", json={"points": [[1.0, 1.0]], "conditions": [0]}).is_success
        for stream in streams:
            stream.__exit__(None, None, None)
        for _ in range(40):
            if client.head(f"{job}/events").is_success:
                break
            time.sleep(0.1)


def test_many_clients_share_what_is_read(client: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    job, read, counted = submitted(client), JobStore.find, []

    def find(store: JobStore, id: str) -> Any:
        counted.append(id)
        return read(store, id)

    monkeypatch.setattr(JobStore, "find", find)

    def reads(clients: int) -> int:
        counted.clear()
        with ThreadPoolExecutor() as pool:
            list(pool.map(lambda _: client.get(job, params={"wait": 1}), range(clients)))
        return len(counted)

    alone, together = reads(1), reads(3)
    assert together < 2 * alone, (alone, together)


def test_streams_end_when_the_service_stops(shelf: Path, tmp_path: Path, serving: Any) -> None:
    with ThreadPoolExecutor() as pool:
        reading = threading.Event()

        def told(address: str) -> list[dict[str, str]]:
            with httpx.stream("GET", f"{address}/events", timeout=30) as stream:
                answer = events(stream.iter_lines())
                seen = [next(answer), next(answer)]
                reading.set()
                return [*seen, *answer]  # a stream that is cut off raises

        with serving(Settings(tables=shelf, jobs=f"sqlite:///{tmp_path}/jobs.sqlite")) as address:
            with httpx.Client(base_url=address, timeout=30) as client:
                job = submitted(client)
            waiting = pool.submit(told, f"{address}{job}")
            assert reading.wait(10)
        assert len(waiting.result(timeout=1)) == 2
