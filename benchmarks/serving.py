"""The service beside bare servers over HTTP, its start, its first picture, its memory, and the first compilation.

    python -m benchmarks.serving [--rounds ROUNDS]

It writes serving.csv (four minutes). All servers run on this machine, one client at a time keeps a connection alive,
and the rounds of the codes alternate. The service is `python -m service` with its default settings and the default
table, which is built first, with an empty cache of numba. The bare server returns the same bytes from one Starlette
route on the same HTTP server, and computes nothing: it is the floor. Another route of it does only what no answer of
a point can do without, which shows whether a target can be reached. A ratio is formed in each round.
"""

import argparse
import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from benchmarks.peers import OURS, spread
from benchmarks.results import write
from benchmarks.servers import ROOT, Connection, Server, bare, service, umbridge

HEADER = ("work", "code", "unit", "median", "least", "most", "first of the work / code", "least", "most", "target",
          "met")
CEILING = "one point without checks, limits, log and metrics: the ceiling of this HTTP stack"
LEAST = "bare Starlette route that reads JSON, interpolates and writes JSON"
_JSON = "Content-Type: application/json\r\n"
_NPY = "Content-Type: application/x-npy\r\nAccept: application/x-npy\r\n"
_POINT = json.dumps({"table": "nominal", "points": [[1.013, 0.971]], "describe": False}).encode()
_UMBRIDGE = json.dumps({"name": "nominal", "input": [[1.013, 0.971]], "config": {}}).encode()
_PICTURE, _OTHER_PICTURE = (
    json.dumps({"table": "nominal", "inputs": {"mean": [mean, 1.0], "std": [0.05, 0.05]},
                "conditions": [0, 100, 200]}).encode() for mean in (1.0, 1.02))
_CANDIDATE = json.dumps({"table": "nominal", "recordings": "measured", "per_condition": False, "candidates": [
    {"mean": [1.0, 1.0], "std": [0.05, 0.08], "output_std": 0.01}]}).encode()
_WARMING_SECONDS = 5.0
"""After which the service has imported what only computations need; a person takes longer to ask for a picture."""
_COUNTED = 1000
"""Requests whose processor time is measured, for which the clock of the kernel has steps of 10 ms."""
Run = Callable[[], float]
Row = tuple[object, ...]


def _array(points: int) -> bytes:
    memory = io.BytesIO()
    np.save(memory, np.random.default_rng(1).uniform(0.6, 1.4, (points, 2)))
    return memory.getvalue()


def compare(work: str, unit: str, codes: dict[str, Run], targets: dict[str, tuple[str, float]],
             rounds: int) -> list[Row]:
    """Rows of the codes by name, with ratios of the first of them; `targets` has ("at least" or "at most", ratio)."""
    for run in codes.values():
        run()
    values = np.array([[run() for run in codes.values()] for _ in range(rounds)])
    rows: list[Row] = []
    for column, name in enumerate(codes):
        ratios = values[:, 0] / values[:, column]
        target = targets.get(name)
        verdict = ("", "") if target is None else (
            f"{target[0]} {target[1]:g}", _judge(float(np.median(ratios)), *target))
        rows.append((work, name, unit, *spread(values[:, column]), *(spread(ratios) if column else ("", "", "")),
                     *verdict))
    return rows


def single(work: str, unit: str, values: list[float], most: float | None) -> Row:
    """The row of a quantity without peer; the aim is a median of at most `most`."""
    verdict = ("", "") if most is None else (f"at most {most:g}", _judge(float(np.median(values)), "at most", most))
    return (work, OURS, unit, *spread(np.array(values)), "", "", "", *verdict)


def _judge(value: float, side: str, target: float) -> str:
    return "yes" if (value >= target if side == "at least" else value <= target) else "no"


def measure_requests(ours: Server, tables: Path, answers: Path, rounds: int) -> list[Row]:
    """One point, and 10,000 points as arrays."""
    with ours.connect() as connection:
        answers.mkdir()
        request = connection.request
        point, points = request("/v1/evaluate", _POINT, _JSON), request("/v1/evaluate", _array(10_000), _NPY)
        (answers / "point.json").write_bytes(connection.exchange(point))
        (answers / "points.npy").write_bytes(connection.exchange(points))
        floor, bridge = bare(answers, tables / "nominal.h5"), umbridge(tables / "nominal.h5")
        try:
            with floor.connect() as to_floor, bridge.connect() as to_bridge:
                least = to_floor.request("/least", _POINT, _JSON)
                assert json.loads(bytes(to_floor.exchange(least)))["shifting_time"] == json.loads(
                    (answers / "point.json").read_bytes())["shifting_time"]
                targets = {"bare Starlette route": ("at least", 0.8), "UM-Bridge's Python server": ("at least", 10.0)}
                rates = compare("one point over HTTP, keep-alive", "requests/s", {
                    OURS: _rate(connection, point, 200),
                    "bare Starlette route": _rate(to_floor, to_floor.request("/point.json", _POINT, _JSON), 200),
                    "UM-Bridge's Python server": _rate(to_bridge, to_bridge.request("/Evaluate", _UMBRIDGE), 100),
                    "this project by UM-Bridge": _rate(connection, request("/umbridge/Evaluate", _UMBRIDGE), 100),
                }, targets, rounds)
                spent = compare("processor time of the server for one point", "ms", {
                    OURS: _measure_processor_time(ours, connection, point),
                    LEAST: _measure_processor_time(floor, to_floor, least),
                    "bare Starlette route": _measure_processor_time(
                        floor, to_floor, to_floor.request("/point.json", _POINT, _JSON)),
                    "UM-Bridge's Python server": _measure_processor_time(
                        bridge, to_bridge, to_bridge.request("/Evaluate", _UMBRIDGE)),
                }, {}, rounds)
                times = compare("10,000 points x 216 as .npy", "ms", {
                    OURS: _milliseconds(connection, points),
                    "loopback copy by a bare Starlette route": _milliseconds(
                        to_floor, to_floor.request("/points.npy", _array(10_000), _NPY)),
                }, {"loopback copy by a bare Starlette route": ("at most", 2)}, 3 * rounds)
                ceiling = compare(CEILING, "requests/s", {
                    LEAST: _rate(to_floor, least, 200),
                    "bare Starlette route": _rate(to_floor, to_floor.request("/point.json", _POINT, _JSON), 200),
                    "UM-Bridge's Python server": _rate(to_bridge, to_bridge.request("/Evaluate", _UMBRIDGE), 100),
                }, targets, rounds)
        finally:
            floor.end()
            bridge.end()
    return [*rates, *ceiling, *spent, *times]


def _rate(connection: Connection, request: bytes, count: int) -> Run:
    def run() -> float:
        begin = time.perf_counter()
        for _ in range(count):
            connection.exchange(request)
        return count / (time.perf_counter() - begin)

    return run


def _measure_processor_time(server: Server, connection: Connection, request: bytes) -> Run:
    def run() -> float:
        begin = server.processor_seconds()
        for _ in range(_COUNTED):
            connection.exchange(request)
        return 1e3 * (server.processor_seconds() - begin) / _COUNTED

    return run


def _milliseconds(connection: Connection, request: bytes) -> Run:
    def run() -> float:
        begin = time.perf_counter()
        connection.exchange(request)
        return 1e3 * (time.perf_counter() - begin)

    return run


def measure_starts(tables: Path, rounds: int) -> list[Row]:
    """From the start of the process to the first answer of the health check; then two likelihoods and two pictures."""
    health, spent, likelihoods, other_likelihoods, pictures, others = [], [], [], [], [], []
    for _ in range(rounds):
        begin = time.perf_counter()
        server = service(tables)
        try:
            with server.connect() as connection:
                connection.exchange(connection.request("/v1/health", method="GET"))
                health.append(time.perf_counter() - begin)
                spent.append(server.processor_seconds())
            time.sleep(_WARMING_SECONDS)
            with server.connect() as connection:
                likelihood = _milliseconds(connection, connection.request("/v1/likelihood", _CANDIDATE, _JSON))
                likelihoods.append(likelihood())
                other_likelihoods.append(likelihood())
                for body, seconds in ((_PICTURE, pictures), (_OTHER_PICTURE, others)):
                    picture = connection.request("/v1/propagate?format=svg", body, _JSON)
                    seconds.append(_milliseconds(connection, picture)() / 1e3)
        finally:
            server.end()
    return [single("start of the service, to its first answer", "s", health, 1.0),
            single("processor time of that start", "s", spent, None),
            single("first likelihood of one candidate over REST", "ms", likelihoods, 2.0),
            single("another likelihood of one candidate over REST", "ms", other_likelihoods, 2.0),
            single("first picture", "s", pictures, 0.5),
            single("another picture", "s", others, 0.2)]


def measure_memory(tables: Path) -> list[Row]:
    """Resident set of a service that has evaluated one point of one table, and of each of ten default tables."""
    names = ["nominal", *(f"copy{number}" for number in range(1, 10))]
    for name in names[1:]:
        shutil.copy(tables / "nominal.h5", tables / f"{name}.h5")
    server, megabytes = service(tables), []
    try:
        with server.connect() as connection:
            for name in names:
                body = json.dumps({"table": name, "points": [[1.0, 1.0]]}).encode()
                connection.exchange(connection.request("/v1/evaluate", body, _JSON))
                if name == names[0]:
                    time.sleep(_WARMING_SECONDS - 1)
                megabytes.append(server.memory())
        own = server.memory("RssAnon")
    finally:
        server.end()
    return [single("memory of the service with one default table", "MB", megabytes[:1], None),
            single("memory of the service with ten default tables", "MB", megabytes[-1:], 400.0),
            single("the same without the mapped pages of libraries", "MB", [own], None)]


def measure_first_use(tables: Path, cache: Path, rounds: int) -> list[Row]:
    """The compilation of the simulator into an empty cache, loading it from there, and building the default table."""
    bench, out = tables / "heavy.toml", tables / "nominal.h5"
    compiled, loaded, built = [], [], []
    for _ in range(rounds):
        shutil.rmtree(cache, ignore_errors=True)
        for processes in (compiled, loaded):
            processes.append(_run(cache, "worker.compiling", str(bench)))
        built.append(_run(cache, "worker", "build", "--bench", str(bench), "--out", str(out)))
    return [single("first use: process that compiles the simulator", "s", [used.seconds for used in compiled], 10.0),
            single("processor time of that process", "s", [used.processor_seconds for used in compiled], None),
            single("process that loads the compiled simulator", "s", [used.seconds for used in loaded], None),
            single("build of the default table, compiled", "s", [used.seconds for used in built], None),
            single("peak memory of that build", "MB", [used.megabytes for used in built], 500.0)]


@dataclass(frozen=True)
class Used:
    """What a process has used; `megabytes` is the peak of its resident set."""

    seconds: float
    processor_seconds: float
    megabytes: float


def _run(cache: Path, *arguments: str) -> Used:
    """Run `python -m ...`."""
    begin = time.perf_counter()
    process = subprocess.Popen([sys.executable, "-m", *arguments], cwd=ROOT, stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL, env={**os.environ, "NUMBA_CACHE_DIR": str(cache)})
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, arguments
    return Used(time.perf_counter() - begin, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024 / 1e6)


def main() -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=7)
    rounds = parser.parse_args().rounds
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # with it, every process would compile all modules of this project
    with tempfile.TemporaryDirectory(prefix="slipstick-serving-") as name:
        tables = Path(name) / "tables"
        tables.mkdir()
        for file in ("heavy.toml", "measured.h5"):
            shutil.copy(ROOT / "tables" / file, tables)
        rows = measure_first_use(tables, Path(name) / "cache", min(rounds, 3))
        rows += measure_starts(tables, rounds)
        server = service(tables)
        try:
            rows += measure_requests(server, tables, Path(name) / "answers", rounds)
        finally:
            server.end()
        rows += measure_memory(tables)
    versions = ", ".join(f"{package} {version(package)}" for package in ("fastapi", "starlette", "uvicorn", "umbridge"))
    rows.append((versions, *[""] * (len(HEADER) - 1)))
    write("serving", HEADER, rows, f"python -m benchmarks.serving --rounds {rounds}")


if __name__ == "__main__":
    main()
