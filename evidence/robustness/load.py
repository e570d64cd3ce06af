"""The service under 64 clients that mix everything for five minutes: errors, times, memory, and health meanwhile.

    python -m benchmarks.load [--seconds SECONDS] [--clients CLIENTS]

The service runs on a temporary folder with the table and recordings of benchmarks.kills and SQLite. The clients run in
this process, each with a connection of its own that is kept alive, and send one request of a weighted random choice
after the other. Errors are transport errors and statuses other than those a request should have; 429 and 503 with
Retry-After are none, and a client waits half a second after them. A further client asks for the health ten times a
second, and does so for 10 s before the others start: what is slow then is the machine. It runs in a process of its own,
because the 64 delay each other. Memory is the resident set of the service. Times are those that the clients see; they
share the processors with the service, as nothing else on the machine should.
"""

import argparse
import asyncio
import io
import multiprocessing
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Awaitable, Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from benchmarks.results import write
from benchmarks.supervised import Stack, prepare

SMALL = ("--axis", "pressure_bias=0.5:1.5:9", "--axis", "initial_position=0.5:1.5:9")
HEADER = ("request", "share", "requests", "expected status", "429 or 503", "cancelled", "errors", "p50 in ms",
          "p99 in ms", "longest in ms")
_INPUTS = {"mean": [1.0, 1.0], "std": [0.05, 0.08]}
_TABLE = {"table": "small"}
_PAUSE = 0.5


@dataclass(frozen=True)
class Kind:
    """A request of the mix: its `weight`, the statuses that it should have, and after how many s it is cancelled."""

    name: str
    weight: int
    method: str
    path: str
    statuses: tuple[int, ...] = (200,)
    body: dict[str, Any] = field(default_factory=dict)
    cancelled_after: float | None = None


def _array(count: int) -> bytes:
    memory = io.BytesIO()
    np.save(memory, np.random.default_rng(1).normal(1, 0.05, (count, 2)))
    return memory.getvalue()


def _npy(count: int) -> dict[str, Any]:
    return {"content": _array(count), "params": {"table": "small", "outside": "clip"},
            "headers": {"Content-Type": "application/x-npy", "Accept": "application/x-npy"}}


_PROPAGATE = {"json": {**_TABLE, "inputs": _INPUTS, "output_std": 0.003, "outside": "clip"}}
_LIKELIHOOD = {"json": {**_TABLE, "recordings": "few", "per_condition": False, "outside": "clip",
                        "candidates": [{**_INPUTS, "output_std": 0.01}] * 4}}
HEALTH = Kind("health, by a client of its own", 0, "GET", "/v1/health")
IDLE = Kind("health, before the load", 0, "GET", "/v1/health")
_IDLE_SECONDS = 10.0
MIX = (
    Kind("evaluate, 2 points", 20, "POST", "/v1/evaluate", body={"json": {**_TABLE, "points": [[1, 1], [0.9, 1.1]]}}),
    Kind("evaluate, 2,000 points as .npy", 8, "POST", "/v1/evaluate", body=_npy(2000)),
    Kind("evaluate, 2,000 points as JSON", 4, "POST", "/v1/evaluate", body={"json": {
        **_TABLE, "points": np.random.default_rng(1).uniform(0.6, 1.4, (2000, 2)).tolist()}}),
    Kind("propagate", 10, "POST", "/v1/propagate", body=_PROPAGATE),
    Kind("likelihood of 4 candidates", 8, "POST", "/v1/likelihood", body=_LIKELIHOOD),
    Kind("list of tables", 8, "GET", "/v1/tables"),
    Kind("list of fits", 8, "GET", "/v1/fits"),
    Kind("description of recordings", 4, "GET", "/v1/recordings/few"),
    Kind("front page", 8, "GET", "/"),
    Kind("report of a fit", 2, "GET", "/v1/fits/finished/report"),
    Kind("upload refused", 6, "POST", "/v1/tables?name=bad", (422,), {
        "content": b"\x89HDF\r\n\x1a\n" + bytes(200_000), "headers": {"Content-Type": "application/x-hdf5"}}),
    Kind("unknown name", 4, "GET", "/v1/tables/nowhere", (404,)),
    Kind("likelihood cancelled after 50 ms", 5, "POST", "/v1/likelihood", body=_LIKELIHOOD, cancelled_after=0.05),
    Kind("report cancelled after 50 ms", 1, "GET", "/v1/fits/finished/report", cancelled_after=0.05))


@dataclass
class Seen:
    """What became of the requests of a kind."""

    milliseconds: list[float] = field(default_factory=list)
    outcomes: Counter[str] = field(default_factory=Counter)
    errors: Counter[str] = field(default_factory=Counter)

    def row(self, kind: Kind) -> tuple[object, ...]:
        """Its row of the table."""
        p50, p99 = np.percentile(self.milliseconds, [50, 99]) if self.milliseconds else (float("nan"),) * 2
        total = sum(one.weight for one in MIX)
        return (kind.name, f"{100 * kind.weight / total:.0f} %", self.outcomes.total(), self.outcomes["expected"],
                self.outcomes["later"], self.outcomes["cancelled"], self.errors.total(), float(p50), float(p99),
                float(max(self.milliseconds, default=float("nan"))))


async def send(client: httpx.AsyncClient, kind: Kind, seen: Seen) -> bool:
    """Send a request; return whether the service asked to come back later."""
    begin = time.perf_counter()
    try:
        response = await asyncio.wait_for(client.request(kind.method, kind.path, **kind.body), kind.cancelled_after)
    except TimeoutError:
        seen.outcomes["cancelled"] += 1
        return False
    except httpx.HTTPError as error:
        seen.outcomes["error"] += 1
        seen.errors[type(error).__name__] += 1
        return False
    later = response.status_code in (429, 503) and "Retry-After" in response.headers
    if not later:
        seen.milliseconds.append(1e3 * (time.perf_counter() - begin))
    if response.status_code in kind.statuses or later:
        seen.outcomes["later" if later else "expected"] += 1
    else:
        seen.outcomes["error"] += 1
        seen.errors[f"{response.status_code} {response.text[:200]}"] += 1
    return later


async def crowd(address: str, clients: int, seconds: float, memory: Callable[[str], None]) -> dict[str, Seen]:
    """What `clients` see in `seconds`."""
    seen: dict[str, Seen] = defaultdict(Seen)
    weights = np.array([one.weight for one in MIX])

    async def mixed(number: int, client: httpx.AsyncClient, end: float) -> None:
        rng = np.random.default_rng([7, number])
        while time.monotonic() < end:
            kind = MIX[int(rng.choice(len(MIX), p=weights / weights.sum()))]
            if await send(client, kind, seen[kind.name]):
                await asyncio.sleep(_PAUSE)

    async def watched() -> None:
        for moment in ("at a tenth", "in the middle"):
            await asyncio.sleep(seconds * (0.1 if moment == "at a tenth" else 0.4))
            memory(moment)

    async with AsyncExitStack() as stack:
        # Made before, because each takes some 50 ms of the processor.
        all_clients = [await stack.enter_async_context(httpx.AsyncClient(base_url=address, timeout=60))
                       for _ in range(clients)]
        watcher = stack.enter_context(ProcessPoolExecutor(1, multiprocessing.get_context("spawn")))
        asked = partial(asyncio.get_running_loop().run_in_executor, watcher, watch_health, address)
        await asked(0.5)  # which imports
        seen[IDLE.name] = await asked(_IDLE_SECONDS)
        end = time.monotonic() + seconds
        work: list[Awaitable[object]] = [mixed(number, client, end) for number, client in enumerate(all_clients)]
        seen[HEALTH.name], *_ = await asyncio.gather(asked(seconds), watched(), *work)
    memory("at the end")
    return seen


def watch_health(address: str, seconds: float) -> Seen:
    """In a process of its own: what a client sees that asks for the health ten times a second."""
    async def watch() -> Seen:
        seen, end = Seen(), time.monotonic() + seconds
        async with httpx.AsyncClient(base_url=address, timeout=60) as client:
            while time.monotonic() < end:
                await send(client, HEALTH, seen)
                await asyncio.sleep(0.1)
        return seen

    return asyncio.run(watch())


def resident(pid: int) -> float:
    """Resident memory of a process in MB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


def prepared(stack: Stack) -> None:
    """Wait for the service, and for a finished fit with a report."""
    while True:
        stack.keep()
        try:
            stack.client.get("/v1/health").raise_for_status()
            break
        except httpx.HTTPError:
            time.sleep(0.2)
    settings = {"population": 8, "generations": 2, "order": 3, "intervals": False, "refine": False}
    stack.client.post("/v1/fits", json={**_TABLE, "recordings": "few", "settings": settings},
                      headers={"Idempotency-Key": "finished"}).raise_for_status()
    while (status := stack.client.get("/v1/fits/finished").json()["status"]) != "done":
        assert status in ("queued", "running"), status
        time.sleep(0.5)
    for kind in MIX:  # what is compiled or imported at its first use is no load
        response = stack.client.request(kind.method, kind.path, timeout=300, **kind.body)
        assert response.status_code in kind.statuses, (kind.name, response.text)
    for worker in ("worker-1", "worker-2"):  # idle from here on
        stack.programs[worker].process.kill()


def main() -> int:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=300.0)
    parser.add_argument("--clients", type=int, default=64)
    arguments = parser.parse_args()
    found: list[tuple[str, float]] = []
    with tempfile.TemporaryDirectory(prefix="slipstick-load-") as folder, tempfile.TemporaryFile("w") as log:
        prepare(Path(folder), SMALL)
        stack = Stack(Path(folder), None, log)
        try:
            prepared(stack)
            service = stack.programs["service"].process

            def memory(moment: str) -> None:
                found.append((moment, resident(service.pid)))

            memory("at the start")
            seen = asyncio.run(crowd(str(stack.client.base_url), arguments.clients, arguments.seconds, memory))
            assert service.poll() is None
        finally:
            stack.end()
    rows = [seen[kind.name].row(kind) for kind in (*MIX, HEALTH, IDLE)]
    width = len(HEADER) - 2
    rows += [("memory of the service " + moment, f"{value:.0f} MB", *[""] * width) for moment, value in found]
    write("load", HEADER, rows, f"python -m benchmarks.load --seconds {arguments.seconds:g} --clients "
                                f"{arguments.clients}")
    errors = {name: dict(one.errors) for name, one in seen.items() if one.errors}
    if errors:
        print(errors, file=sys.stderr)
    return int(bool(errors))


if __name__ == "__main__":
    sys.exit(main())
