"""Large and many requests: refused while they arrive, computed a few at a time, and abandoned with their client."""

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from test_problems import INPUTS, JSON, POSTS, problem

from service import app
from service.bodies import BodyLimits
from service.computations import Client, Computations
from service.problem_details import Busy, TooSlow
from service.routes import evaluate, likelihood
from service.settings import Settings
from slipstick.storage.library import Library

RECORDING = ("current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]\n"
             "0,150,2,10,0.5\n")


@pytest.fixture
def computations(monkeypatch: pytest.MonkeyPatch) -> Computations:
    """The computations of the service: one at a time, and one that waits."""
    made, uploads = Computations(1, 1, 20), Computations(1, 1, 20)
    both = iter((made, uploads))
    monkeypatch.setattr("service.app.Computations", lambda *_: next(both))
    return made


def wait_until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


@pytest.fixture
def client(shelf: Path, tmp_path: Path, serving, computations: Computations) -> Iterator[httpx.Client]:
    settings = Settings(tables=shelf, jobs=f"sqlite:///{tmp_path}/jobs.sqlite", computations=1, waiting=1,
                        json_bytes=100_000, bodies_bytes=400_000, waiting_seconds=20)
    with serving(settings) as address, httpx.Client(base_url=address, timeout=30) as client:
        yield client


class Held:
    """A likelihood of a client that starts computing and continues when told."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.started, self.go_on, self.ended = threading.Semaphore(0), threading.Event(), threading.Semaphore(0)
        self.count, computed = 0, likelihood._estimate

        posted = likelihood.LikelihoodRequest.model_validate(POSTS["/v1/likelihood"])

        def hold(body: likelihood.LikelihoodRequest, *arguments: Any) -> Any:
            if body != posted:  # that which services rehearse after their start
                return computed(body, *arguments)
            self.count += 1
            self.started.release()
            try:
                assert self.go_on.wait(20)
                return computed(body, *arguments)
            finally:
                self.ended.release()

        monkeypatch.setattr(likelihood, "_estimate", hold)


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch) -> Held:
    return Held(monkeypatch)


def test_reading_goes_on_while_computations_are_held_and_others_wait_or_are_refused(
        client: httpx.Client, computations: Computations, held: Held) -> None:
    with ThreadPoolExecutor(3) as pool:
        first = pool.submit(client.post, "/v1/likelihood", json=POSTS["/v1/likelihood"])
        assert held.started.acquire(timeout=20)
        second = pool.submit(client.post, "/v1/likelihood", json=POSTS["/v1/likelihood"])
        wait_until(lambda: computations.waiting == 1)
        refused = client.post("/v1/evaluate", json={"points": [[1, 1]] * 2})
        assert problem(refused, 503)["type"].endswith(":busy")
        assert refused.headers["Retry-After"] == "2"
        for path in ("/v1/health", "/v1/tables/nominal", "/v1/fits", "/v1"):
            assert client.get(path).is_success
        # One point takes less time than a place; the likelihood has read the table.
        assert client.post("/v1/evaluate", json={"points": [[1, 1]]}).is_success
        upload = client.post("/v1/recordings", params={"name": "one", "bench": "heavy"}, content=RECORDING.encode(),
                             headers={"Content-Type": "text/csv"})
        assert upload.status_code == 201, upload.text
        assert client.delete("/v1/recordings/one").is_success
        assert held.count == 1
        held.go_on.set()
        for response in (first.result(), second.result()):
            assert response.status_code == 200, response.text
    assert client.post("/v1/evaluate", json=POSTS["/v1/evaluate"]).is_success


def post(client: httpx.Client, content: bytes) -> socket.socket:
    """Send a request for a likelihood on a connection of its own."""
    connection = socket.create_connection((client.base_url.host, client.base_url.port or 0), timeout=20)
    connection.sendall(b"POST /v1/likelihood HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
                       b"Content-Length: %d\r\n\r\n%s" % (len(content), content))
    return connection


def test_abandoned_requests_stop_or_never_start(client: httpx.Client, computations: Computations,
                                                held: Held) -> None:
    content = client.build_request("POST", "/", json=POSTS["/v1/likelihood"]).content
    computing = post(client, content)
    assert held.started.acquire(timeout=20)
    waiting = post(client, content)
    wait_until(lambda: computations.waiting == 1)
    waiting.close()
    wait_until(lambda: computations.waiting == 0)
    computing.close()
    assert computations.places.locked()  # a computation keeps its place until it ends
    held.go_on.set()
    assert held.ended.acquire(timeout=20)
    wait_until(lambda: not computations.places.locked())
    assert held.count == 1  # the waiting request never started
    assert client.post("/v1/likelihood", json=POSTS["/v1/likelihood"]).is_success  # its place is free again
    assert held.count == 2


def test_a_computation_ends_at_its_next_model_run_after_the_client_is_gone() -> None:
    gone, runs = threading.Event(), []
    model = Client(gone).watched(lambda points, _: runs.append(points) or points)
    model(np.ones((1, 2)), None)
    gone.set()
    with pytest.raises(TooSlow):
        model(np.ones((1, 2)), None)
    assert len(runs) == 1


def test_a_request_waits_for_a_limited_time() -> None:
    async def wait() -> None:
        computations = Computations(1, 1, 0.01)
        async with computations.place():
            with pytest.raises(Busy, match=r"within 0\.01 s"):
                async with computations.place():
                    pytest.fail("two at once")
        async with computations.place():
            assert computations.waiting == 0

    asyncio.run(wait())


def test_a_json_body_is_refused_at_the_limit_while_it_arrives() -> None:
    taken: list[int] = []

    async def send_body(size: int) -> int:
        statuses: list[int] = []

        async def receive() -> dict[str, Any]:
            taken.append(size)
            return {"type": "http.request", "body": b" " * 10_000, "more_body": len(taken) < size}

        async def send(message: Any) -> None:
            statuses.append(message.get("status", 0))

        async def application(_: Any, receive: Any, send: Any) -> None:
            assert limits.held == len((await receive())["body"])
            await send({"type": "http.response.start", "status": 200, "headers": []})

        limits = BodyLimits(application, Settings(json_bytes=50_000, bodies_bytes=80_000))
        taken.clear()
        media_type = b"application/json" if size != 9 else b"application/x-npy"
        await limits({"type": "http", "method": "POST", "headers": [(b"content-type", media_type)]}, receive, send)
        assert limits.held == 0
        return statuses[0]

    assert (asyncio.run(send_body(1000)), len(taken)) == (413, 6)
    assert (asyncio.run(send_body(5)), len(taken)) == (200, 5)
    assert (asyncio.run(send_body(9)), len(taken)) == (503, 9)  # .npy: the memory for all bodies is the limit


def test_points_are_counted_before_they_are_checked(client: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    checked: list[int] = []
    check = evaluate._check_points
    monkeypatch.setattr(evaluate, "_check_points", lambda points: checked.append(len(points)) or check(points))
    problem(client.post("/v1/evaluate", content=b'{"points": [' + b"1," * 20_000 + b"1]}", headers=JSON), 413)
    assert checked == []
    problem(client.post("/v1/evaluate", json={"points": [1, 2]}), 422)
    assert checked == [2]
    assert client.post("/v1/likelihood", json={"candidates": [{**INPUTS, "output_std": 0.01}] * 5000}
                       ).status_code == 413


def test_one_point_of_a_table_that_was_read_needs_no_thread(client: httpx.Client, monkeypatch: pytest.MonkeyPatch
                                                            ) -> None:
    threads: list[threading.Thread] = []
    answer = evaluate._answer
    monkeypatch.setattr(evaluate, "_answer",
                        lambda *given: threads.append(threading.current_thread()) or answer(*given))
    one, two, some = {"points": [[1, 1]]}, {"points": [[1, 1]] * 2}, {"points": [[1, 1]], "conditions": [0]}
    answers = [client.post("/v1/evaluate", json=body).json() for body in (two, one, two, some, one)]
    assert threads[1] is threads[4]  # that of the event loop
    assert threads[1] not in (threads[0], threads[2], threads[3])
    assert answers[0]["shifting_time"][0] == answers[1]["shifting_time"][0] == answers[4]["shifting_time"][0]


def test_every_limit_is_listed(client: httpx.Client) -> None:
    listed = client.get("/v1").json()["limits"]
    assert listed == {name: value for name, value in Settings(json_bytes=100_000, bodies_bytes=400_000, computations=1,
                                                             waiting=1, waiting_seconds=20)
                      if name != "port" and isinstance(value, int | float)}
    assert {"json_bytes", "work_values", "engagements"} <= set(listed)


def test_the_health_answers_while_all_places_to_read_are_taken(client: httpx.Client,
                                                               monkeypatch: pytest.MonkeyPatch) -> None:
    reading, go_on = threading.Semaphore(0), threading.Event()

    def listed(_: Library) -> list[str]:
        reading.release()
        assert go_on.wait(20)
        return []

    monkeypatch.setattr(Library, "benches", listed)
    with ThreadPoolExecutor(8) as pool:
        lists = [pool.submit(client.get, "/v1/benches") for _ in range(8)]
        for _ in range(app._READING):
            assert reading.acquire(timeout=20)
        monkeypatch.setattr(Library, "benches", lambda _: [])
        for path in ("/v1/health", "/v1/live", "/v1/ready"):
            assert client.get(path).is_success
        assert not any(one.done() for one in lists)
        go_on.set()
        assert all(one.result().is_success for one in lists)
    assert not reading.acquire(blocking=False)  # no other list was read at the same time
