"""Jobs under random `kill -9`: is any lost, doubled, or different from an undisturbed one?

    python -m evidence.robustness.kills [KILLS]

A service and two workers run on a temporary folder with PostgreSQL, and then with SQLite, which has no process of its
own. In each round, some fits, a study, or the build of a table are begun, and processes of them are killed with SIGKILL
at random times, the first often while the jobs are submitted. Like a supervisor, the command starts again what has
ended, at once or after 8 s, in which the other worker takes over. A client repeats a submission without response with
the same `Idempotency-Key`. The victims and times of a round follow from its number. After the round, every job must
exist once, and its result must be that of the undisturbed run. Finished rounds are kept in var/kills.csv: the same
command continues after them. Ten minutes.
"""

import argparse
import csv
import hashlib
import json
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from evidence.robustness.supervised import ROOT, Program, Stack, write_tables
from evidence.robustness.table import Row, replace_rows
from slipstick.table import Table
from tests.postgresql import Server, program

KILLS, KILLS_A_ROUND, SEED, PATIENCE = 50, 4, 16, 1500.0
DATABASES = ("PostgreSQL", "SQLite")
WORKS = ("fits", "study", "build")
VICTIMS = ("service", "worker", "database", "build")
CYCLE = (("PostgreSQL", "fits"), ("SQLite", "fits"), ("PostgreSQL", "study"), ("SQLite", "study"), ("SQLite", "build"),
         ("PostgreSQL", "fits"), ("SQLite", "fits"), ("PostgreSQL", "study"), ("SQLite", "build"), ("SQLite", "build"))
"""Database and work of the rounds. Builds use no database: they run beside the service on SQLite."""
LARGE = ("--axis", "pressure_bias=0.5:1.5:120", "--axis", "initial_position=0.5:1.5:100")  # of all 216 conditions
_FIT = {"table": "small", "recordings": "few"}
_SEARCH = {"population": 16, "generations": 12, "patience": 12, "order": 3, "intervals": False}
JOBS: dict[str, dict[str, dict[str, Any]]] = {
    "fits": {"intervals": {**_FIT, "parameters": ["initial_position"],
                           "settings": {**_SEARCH, "seed": 1, "intervals": True}},
             "simulated": {**_FIT, "simulate": True, "settings": {**_SEARCH, "seed": 2}},
             "correlated": {**_FIT, "settings": {**_SEARCH, "seed": 3, "correlated": True}}},
    "study": {"few": {"recordings": "few"}}}


@dataclass(frozen=True)
class Round:
    """How often each victim was killed in a round, and what became of its jobs."""

    number: int
    database: str
    work: str
    service: int
    worker: int
    database_server: int
    build: int
    jobs: int
    lost: int
    doubled: int
    different: int


class Blow:
    """A SIGKILL for a random victim, at a random time after the one before."""

    def __init__(self, victims: dict[str, Program], rng: np.random.Generator, longest: float) -> None:
        self.victims, self.rng, self.longest = victims, rng, longest
        self.counts: Counter[str] = Counter()
        self._plan()

    def _plan(self) -> None:
        self.due = time.monotonic() + float(self.rng.uniform(0, self.longest))

    def strike(self) -> None:
        """Kill, if the time has come."""
        if self.counts.total() == KILLS_A_ROUND or time.monotonic() < self.due:
            return
        kinds = sorted({name.partition("-")[0] for name in self.victims})
        kind = str(self.rng.choice(kinds))
        name = str(self.rng.choice([name for name in sorted(self.victims) if name.startswith(kind)]))
        pause = float(self.rng.choice([0.0, 8.0])) if kind == "worker" else 0.0
        if self.victims[name].process.poll() is None:
            self.victims[name].kill(pause)
            self.counts[kind] += 1
        self._plan()


def compute_digest(result: dict[str, Any]) -> str:
    """SHA-256 of what a result says, apart from the seconds that it took."""
    content = {name: value for name, value in result.items() if name not in ("id", "seconds", "processor_seconds")}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def run_jobs(stack: Stack, work: str, prefix: str, blow: Blow | None = None) -> tuple[dict[str, str], int]:
    """Run the jobs of `work`: digests of the results of those that have ended in time, and how many jobs there are."""
    address = "/v1/studies" if work == "study" else "/v1/fits"
    waiting = [f"{prefix}-{name}" for name in JOBS[work]]
    submitted, digests, deadline = set[str](), dict[str, str](), time.monotonic() + PATIENCE
    while (waiting or (blow and blow.counts.total() < KILLS_A_ROUND)) and time.monotonic() < deadline:
        stack.keep()
        if blow:
            blow.strike()
        for id in list(waiting):
            name = id.removeprefix(f"{prefix}-")
            try:
                if id not in submitted:
                    answer = stack.client.post(address, json=JOBS[work][name], headers={"Idempotency-Key": id})
                    if answer.status_code == 202:
                        submitted.add(id)
                    elif answer.status_code != 503:
                        raise ValueError(answer.text)
                    continue
                job = stack.client.get(f"{address}/{id}")
                if job.is_success and job.json()["status"] not in ("queued", "running"):
                    result = stack.client.get(f"{address}/{id}/result")
                    if result.status_code == 503:
                        continue
                    waiting.remove(id)
                    digests[name] = compute_digest(result.json()) if result.is_success else result.text
                elif job.status_code not in (200, 503):
                    waiting.remove(id)
                    digests[name] = job.text
            except httpx.TransportError:
                break
        time.sleep(0.2)
    while True:
        stack.keep()
        try:
            listed = stack.client.get(address, params={"limit": 1000}).raise_for_status()
            break
        except httpx.HTTPError:
            time.sleep(0.1)
    ids = [job["id"] for job in listed.json()["studies" if work == "study" else "fits"]]
    return digests, len([id for id in ids if id.startswith(f"{prefix}-")])


def build_table(stack: Stack, rng: np.random.Generator | None, longest: float) -> tuple[str, Counter[str]]:
    """Build the large table, with kills at random times if there is `rng`: its digest, and the kills."""
    path, begin = stack.folder / "large.h5", time.monotonic()
    path.unlink(missing_ok=True)
    build = Program(lambda: stack.start("worker", "build", *LARGE, "--out", str(path)))
    blow = Blow({"build": build}, rng, longest) if rng else None
    while build.process.poll() != 0 and time.monotonic() < begin + PATIENCE:
        if blow:
            blow.strike()
        build.keep()
        time.sleep(0.02)
    digest = Table.open(path).digest if path.exists() else "no table"
    return digest, blow.counts if blow else Counter()


def run_rounds(stack: Stack, database: str, works: dict[int, str]) -> Iterator[Round]:
    """Run the rounds, of which `works` has the numbers and the work of each."""
    expected, seconds = dict[str, dict[str, str]](), dict[str, float]()
    for number, work in sorted(works.items(), key=lambda planned: planned[1]):
        if work not in expected:
            begin = time.monotonic()
            expected[work] = {"table": build_table(stack, None, 0.0)[0]} if work == "build" else \
                run_jobs(stack, work, f"undisturbed-{time.time():.0f}")[0]
            seconds[work] = time.monotonic() - begin
            print(f"{database}, {work}: undisturbed in {seconds[work]:.1f} s: {expected[work]}", flush=True)
        rng, begin = np.random.default_rng([SEED, number]), time.monotonic()
        longest = seconds[work] / (4 if work == "build" else 2)  # a build ends whether it was killed or not
        if work == "build":
            digest, counts = build_table(stack, rng, longest)
            results, jobs = {"table": digest}, 1
        else:
            blow = Blow(stack.programs, rng, longest)
            results, jobs = run_jobs(stack, work, f"round-{number}-{time.time():.0f}", blow)
            counts = blow.counts
        different = {name: results[name] for name in results if results[name] != expected[work][name]}
        wanted = len(expected[work])
        row = Round(number, database, work, *(counts[victim] for victim in VICTIMS), wanted,
                    max(wanted - min(len(results), jobs), 0), max(jobs - wanted, 0), len(different))
        print(f"{row}, {time.monotonic() - begin:.1f} s {different or ''}", flush=True)
        yield row


@contextmanager
def run_stack(database: str, folder: Path) -> Iterator[Stack]:
    """Keep the stack on a database within the context; its output goes to var/kills.log."""
    server = Server() if database == "PostgreSQL" else None
    with (ROOT / "var" / "kills.log").open("a") as log:
        stack = Stack(folder, server, log)
        try:
            yield stack
        finally:
            stack.end()
            if server:
                server.remove()


def read_rounds(path: Path) -> list[Round]:
    """Read the rounds of earlier runs."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        types: list[Callable[[str], Any]] = [str if column.type is str else int for column in fields(Round)]
        return [Round(*(cast(entry) for cast, entry in zip(types, row, strict=True))) for row in csv.reader(file)]


def summarize(done: list[Round]) -> list[Row]:
    """Add the rounds of each work on each database."""
    rows = []
    for work in WORKS:
        for database in DATABASES:
            chosen = [row for row in done if (row.database, row.work) == (database, work)]
            if not chosen:
                continue
            counts = [sum(column) for column in zip(*(astuple(row)[3:] for row in chosen), strict=True)]
            kills, (jobs, lost, doubled, different) = counts[:len(VICTIMS)], counts[len(VICTIMS):]
            victims = ", ".join(f"{count} of {victim}" for victim, count in zip(VICTIMS, kills, strict=True) if count)
            what = "build of a table" if work == "build" else f"{work} on {database}"
            rows.append(Row(f"{what}: {sum(kills)} kills ({victims}), rounds: {len(chosen)}", jobs,
                            max(jobs - lost - doubled - different, 0), "jobs",
                            f"{lost} lost, {doubled} doubled, {different} with another result"))
    return rows


def main() -> int:
    """Run the rounds that are missing, and write the table."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("kills", type=int, nargs="?", default=KILLS, help="number of kills (default: %(default)s)")
    kills = parser.parse_args().kills
    if not program("initdb"):
        parser.error("PostgreSQL is missing: apt-get update && apt-get install -y postgresql")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that it ends what it has started
    path = ROOT / "var" / "kills.csv"
    path.parent.mkdir(exist_ok=True)
    done = read_rounds(path)
    planned = {number: CYCLE[number % len(CYCLE)] for number in range(-(-kills // KILLS_A_ROUND))}
    for database in DATABASES:
        missing = {number: work for number, (planned_database, work) in planned.items()
                   if planned_database == database and number not in {row.number for row in done}}
        if not missing:
            continue
        with tempfile.TemporaryDirectory(prefix="slipstick-kills-") as folder:
            write_tables(Path(folder))
            with run_stack(database, Path(folder)) as stack:
                for row in run_rounds(stack, database, missing):
                    done.append(row)
                    with path.open("a", newline="") as file:
                        csv.writer(file).writerow(astuple(row))
    replace_rows("kills", summarize([row for row in done if row.number in planned]),
                 f"python -m evidence.robustness.kills {kills}")
    return int(any(row.lost or row.doubled or row.different for row in done))


if __name__ == "__main__":
    try:
        sys.exit(main())
    except subprocess.CalledProcessError as failure:
        sys.exit(failure.returncode)
