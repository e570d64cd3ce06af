"""The service under 64 clients that mix everything for five minutes: errors, times, memory, and health meanwhile.

    python -m evidence.robustness.load [--seconds SECONDS] [--clients CLIENTS]

The service runs on a temporary folder with a small table, 24 recordings, and SQLite. The clients run in this
process, each with a connection of its own that is kept alive, and send one request of a weighted random choice
after the other. Errors are transport errors and statuses other than those a request should have; 429 and 503 with
Retry-After are none, and a client waits half a second after them. A further client asks for the health ten times a
second, and does so for 10 s before the others start: what is slow then is the machine. It runs in a process of its own,
because the 64 delay each other. Memory is the resident set of the service. Times are those that the clients see; they
share the processors with the service, as nothing else on the machine should. Six minutes.
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

from evidence.robustness.supervised import Stack, write_tables
from evidence.robustness.table import Row, replace_rows

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


def _npy(count: int) -> dict[str, Any]:
    memory = io.BytesIO()
    np.save(memory, np.random.default_rng(1).normal(1, 0.05, (count, 2)))
    return {"content": memory.getvalue(), "params": {"table": "small", "outside": "clip"},
            "headers": {"Content-Type": "application/x-npy", "Accept": "application/x-npy"}}


_PROPAGATE = {"json": {**_TABLE, "inputs": _INPUTS, "output_std": 0.003, "outside": "clip"}}
_LIKELIHOOD = {"json": {**_TABLE, "recordings": "few", "per_condition": False, "outside": "clip",
                        "candidates": [{**_INPUTS, "output_std": 0.01}] * 4}}
HEALTH = Kind("health, by a client in another process", 0, "GET", "/v1/health")
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
class Outcomes:
    """What became of the requests of a kind."""

    milliseconds: list[float] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)
    errors: Counter[str] = field(default_factory=Counter)

    def describe(self, kind: Kind) -> Row:
        """The row of the table."""
        parts = []
        if self.milliseconds:
            median, most = np.percentile(self.milliseconds, [50, 99])
            parts.append(f"median {median:.4g} ms, 99 % in {most:.4g} ms, longest {max(self.milliseconds):.4g} ms")
        if kind.cancelled_after:
            parts.append(f"cancelled by the client: {self.counts['cancelled']}")
        parts.append(f"429 or 503: {self.counts['later']}")
        total = self.counts.total()
        return Row(kind.name, total, total - self.counts["error"], "requests", "; ".join(parts))


async def send(client: httpx.AsyncClient, kind: Kind, outcomes: Outcomes) -> bool:
    """Send a request; return whether the service asked to come back later."""
    begin = time.perf_counter()
    try:
        response = await asyncio.wait_for(client.request(kind.method, kind.path, **kind.body), kind.cancelled_after)
    except TimeoutError:
        outcomes.counts["cancelled"] += 1
        return False
    except httpx.HTTPError as error:
        outcomes.counts["error"] += 1
        outcomes.errors[type(error).__name__] += 1
        return False
    later = response.status_code in (429, 503) and "Retry-After" in response.headers
    if not later:
        outcomes.milliseconds.append(1e3 * (time.perf_counter() - begin))
    if response.status_code in kind.statuses or later:
        outcomes.counts["later" if later else "expected"] += 1
    else:
        outcomes.counts["error"] += 1
        outcomes.errors[f"{response.status_code} {response.text[:200]}"] += 1
    return later


async def send_mix(address: str, clients: int, seconds: float, memory: Callable[[], None]) -> dict[str, Outcomes]:
    """Send the mix by `clients` for `seconds`: what became of the requests, by the name of their kind.

    `memory` is called at a tenth of the time, in the middle and at the end.
    """
    outcomes: dict[str, Outcomes] = defaultdict(Outcomes)
    weights = np.array([kind.weight for kind in MIX])

    async def send_random(number: int, client: httpx.AsyncClient, end: float) -> None:
        rng = np.random.default_rng([7, number])
        while time.monotonic() < end:
            kind = MIX[int(rng.choice(len(MIX), p=weights / weights.sum()))]
            if await send(client, kind, outcomes[kind.name]):
                await asyncio.sleep(_PAUSE)

    async def watch_memory() -> None:
        for pause in (0.1, 0.4):
            await asyncio.sleep(pause * seconds)
            memory()

    async with AsyncExitStack() as stack:
        # Made before, because each takes some 50 ms of the processor.
        all_clients = [await stack.enter_async_context(httpx.AsyncClient(base_url=address, timeout=60))
                       for _ in range(clients)]
        watcher = stack.enter_context(ProcessPoolExecutor(1, multiprocessing.get_context("spawn")))
        ask = partial(asyncio.get_running_loop().run_in_executor, watcher, watch_health, address)
        await ask(0.5)  # which imports
        outcomes[IDLE.name] = await ask(_IDLE_SECONDS)
        end = time.monotonic() + seconds
        work: list[Awaitable[object]] = [send_random(number, client, end) for number, client in enumerate(all_clients)]
        outcomes[HEALTH.name], *_ = await asyncio.gather(ask(seconds), watch_memory(), *work)
    memory()
    return outcomes


def watch_health(address: str, seconds: float) -> Outcomes:
    """Ask for the health ten times a second, in a process of its own."""
    async def watch() -> Outcomes:
        outcomes, end = Outcomes(), time.monotonic() + seconds
        async with httpx.AsyncClient(base_url=address, timeout=60) as client:
            while time.monotonic() < end:
                await send(client, HEALTH, outcomes)
                await asyncio.sleep(0.1)
        return outcomes

    return asyncio.run(watch())


def read_memory(pid: int) -> float:
    """Resident memory of a process in MB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


def finish_a_fit(stack: Stack) -> None:
    """Wait for the service, run a fit to its end, and send each kind of request once; the workers then end."""
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
    """Measure, and replace the rows of the table."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=300.0)
    parser.add_argument("--clients", type=int, default=64)
    arguments = parser.parse_args()
    megabytes: list[float] = []
    with tempfile.TemporaryDirectory(prefix="slipstick-load-") as folder, tempfile.TemporaryFile("w") as log:
        write_tables(Path(folder))
        stack = Stack(Path(folder), None, log)
        try:
            finish_a_fit(stack)
            service = stack.programs["service"].process

            def memory() -> None:
                megabytes.append(read_memory(service.pid))

            memory()
            outcomes = asyncio.run(send_mix(str(stack.client.base_url), arguments.clients, arguments.seconds, memory))
            assert service.poll() is None
        finally:
            stack.end()
    rows = [outcomes[kind.name].describe(kind) for kind in (*MIX, HEALTH, IDLE)]
    rows.append(Row("memory of the service at the start, at a tenth, in the middle and at the end", None, None, "",
                    ", ".join(f"{value:.0f}" for value in megabytes) + " MB"))
    replace_rows("load", rows, f"python -m evidence.robustness.load --seconds {arguments.seconds:g} --clients "
                               f"{arguments.clients}")
    errors = {name: dict(outcome.errors) for name, outcome in outcomes.items() if outcome.errors}
    if errors:
        print(errors, file=sys.stderr)
    return int(bool(errors))


if __name__ == "__main__":
    sys.exit(main())
