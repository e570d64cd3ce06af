"""What a user waits for before anything is computed: `python -m benchmarks.startup`, on two idle cores.

Every measurement starts a new process. The first use after an installation has an empty cache of compiled code.
"""

import json
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path

import slipstick
from benchmarks.results import write
from slipstick.storage.shipped import FOLDER

ROUNDS, FIRST_ROUNDS = 7, 3
_LATER = 3.0  # s, in which the service starts what draws pictures
_STUDY = """
import sys, time
begin = time.perf_counter()
import slipstick
bench, runs = slipstick.Bench.open("heavy"), slipstick.Recordings.open("sample")
def show(text, share):
    print(time.perf_counter() - begin, flush=True)
slipstick.study(bench, runs, progress=show)
print(time.perf_counter() - begin)
"""


def main() -> None:
    """Measure, and write the table."""
    rows = []
    for what, aim, measure, rounds in (
            ("import slipstick", 0.3, lambda: run("-c", "import slipstick"), ROUNDS),
            ("slipstick --help", 0.3, lambda: run("-m", "worker", "--help"), ROUNDS),
            ("slipstick study --help", None, lambda: run("-m", "worker", "study", "--help"), ROUNDS),
            ("first study: until it says that it compiles", None, until_said, FIRST_ROUNDS),
            ("first study: until it is compiled", 10.0, until_compiled, FIRST_ROUNDS),
            ("study of the sample, compiled", None, lambda: study(None)[-1], FIRST_ROUNDS),
            ("start of the service until /v1/health", 1.0, lambda: serve()[0], ROUNDS),
            (f"first page with pictures, {_LATER:g} s after the start", 1.0, lambda: serve()[1], ROUNDS)):
        seconds = sorted(measure() for _ in range(rounds))
        median = statistics.median(seconds)
        rows.append([what, f"{median:.3g}", f"{seconds[0]:.3g} to {seconds[-1]:.3g}", aim or "",
                     "" if aim is None else "yes" if median <= aim else "no"])
        print(*rows[-1], sep=", ", flush=True)
    write("startup", ["what", "median [s]", "range [s]", "aim [s]", "met"], rows, "python -m benchmarks.startup")


def run(*words: str) -> float:
    """Time in s of a Python process."""
    begin = time.perf_counter()
    subprocess.run([sys.executable, *words], check=True, capture_output=True)
    return time.perf_counter() - begin


def study(cache: str | None) -> list[float]:
    """Times in s from the start of a study to each of its steps, and to its end."""
    environment = os.environ if cache is None else {**os.environ, "NUMBA_CACHE_DIR": cache}
    done = subprocess.run([sys.executable, "-c", _STUDY], env=environment, check=True, capture_output=True, text=True)
    return [float(line) for line in done.stdout.split()]


def until_compiled() -> float:
    """Time in s of the compilation: from the start to the first step, less that of a study that is compiled."""
    with tempfile.TemporaryDirectory() as cache:
        return study(cache)[0] - study(cache)[0]


def until_said() -> float:
    """Time in s from the start of a study with an empty cache to the first line that says so."""
    with tempfile.TemporaryDirectory() as cache:
        begin = time.perf_counter()
        process = subprocess.Popen([sys.executable, "-c", _STUDY], env={**os.environ, "NUMBA_CACHE_DIR": cache},
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        assert process.stderr is not None
        process.stderr.readline()
        seconds = time.perf_counter() - begin
        process.kill()
        process.communicate()
        return seconds


def serve() -> tuple[float, float]:
    """Times in s from the start of the service to its first response, and of its first page with pictures."""
    with tempfile.TemporaryDirectory() as folder:
        bench = slipstick.Bench.open(FOLDER / "heavy.toml")
        slipstick.build(bench, {"pressure_bias": (0.8, 1.2, 5)}, out=Path(folder, "nominal.h5"), progress=False)
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = str(probe.getsockname()[1])
        environment = {**os.environ, "SLIPSTICK_PORT": port, "SLIPSTICK_TABLES": folder,
                       "SLIPSTICK_JOBS": f"sqlite:///{folder}/jobs.sqlite"}
        begin = time.perf_counter()
        service = subprocess.Popen([sys.executable, "-m", "service"], env=environment, stderr=subprocess.DEVNULL)
        try:
            wait_for(lambda: ask(port, "/v1/health"))
            started = time.perf_counter()
            time.sleep(_LATER)
            asked = time.perf_counter()
            body = {"inputs": {"mean": [1.0], "std": [0.05]}, "conditions": [0, 100, 215]}
            ask(port, "/v1/propagate?format=html", body)
            return started - begin, time.perf_counter() - asked
        finally:
            service.terminate()
            service.wait()


def wait_for(request: Callable[[], object]) -> None:
    """Repeat a request until the service responds."""
    while True:
        try:
            request()
            return
        except OSError:
            time.sleep(0.01)


def ask(port: str, path: str, body: object = None) -> bytes:
    """The response to a request."""
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(f"http://127.0.0.1:{port}{path}", data, {"Content-Type": "application/json"})
    with urllib.request.urlopen(request, timeout=60) as response:
        content: bytes = response.read()
    return content


if __name__ == "__main__":
    main()
