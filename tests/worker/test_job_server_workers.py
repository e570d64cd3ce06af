"""Several workers on one PostgreSQL server: killed workers and a killed server lose no job, and change no result."""

import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from test_serve_jobs import ENDLESS, SHORT, Bench, ended, in_stage, uninterrupted

from tests.postgresql import PASSWORD, Server

LONG = {**ENDLESS, "generations": 150, "patience": 150, "refine": False, "intervals": False}


def until(condition: Callable[[], bool], seconds: float = 60) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)


@pytest.mark.slow
def test_two_workers_share_jobs_and_one_takes_over_those_of_the_other(
        postgresql: Server, shelf: Path, few_recordings: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str],
        launch: Callable[..., subprocess.Popen[bytes]]) -> None:
    bench = Bench(shelf, few_recordings / "few.h5", tmp_path, launch, postgresql.url("jobs"))

    def workers() -> int:
        return int(bench.client.get("/v1/health").json()["workers"])

    first = bench.worker
    bench.work("worker-2")
    until(lambda: workers() == 2)

    # Two endless fits run at the same time, one a worker; a third one waits, and is cancelled in the queue.
    for name in ("endless", "taken-over", "waiting"):
        bench.submit(name, **(LONG if name == "taken-over" else ENDLESS))
    on = {}
    for name in ("endless", "taken-over"):
        on[name] = bench.follow(name, in_stage("search", 1))["note"].split("'")[1]
    assert set(on.values()) == {"worker-1", "worker-2"}
    assert bench.client.get("/v1/fits/waiting").json()["ahead"] == 0
    assert bench.client.post("/v1/fits/waiting/cancel").json()["status"] == "cancelled"
    assert bench.client.delete("/v1/fits/waiting").status_code == 204
    assert bench.client.get("/v1/fits/waiting").status_code == 404

    # The worker of the second fit is killed: the other one has it within 10 s, as soon as its own ends.
    bench.kill(first if on["taken-over"] == "worker-1" else bench.worker)
    killed = time.monotonic()
    bench.client.post("/v1/fits/endless/cancel")
    bench.follow("taken-over", lambda found: ended(found) or (
        found["status"] == "running" and f"'{on['endless']}'" in found["note"]), seconds=20)
    assert time.monotonic() < killed + 10
    assert workers() == 1

    # The server crashes in the same fit, and comes back.
    before = bench.follow("taken-over", in_stage("search", 1))
    assert before["status"] == "running"
    postgresql.kill()
    until(lambda: bench.client.get("/v1/health").status_code == 503)  # which is read at most once a second
    postgresql.start()
    assert bench.follow("taken-over", ended)["status"] == "done"
    result = bench.client.get("/v1/fits/taken-over/result").json()["result"]
    assert result == json.loads(json.dumps(uninterrupted(shelf, **LONG)))
    bench.submit("after", **SHORT)
    assert bench.follow("after", ended)["status"] == "done"
    assert workers() == 1

    help_text = subprocess.run([sys.executable, "-m", "worker", "serve-jobs", "--help"], capture_output=True, text=True,
                               env={**bench.environment, "COLUMNS": "200"}, check=True).stdout
    assert "SLIPSTICK_JOBS" in help_text
    assert PASSWORD not in help_text
    for process in (bench.service, first, bench.worker):
        process.kill()
        process.wait()
    said = "".join(capfd.readouterr())
    assert f"in postgresql://slipstick:***@127.0.0.1:{postgresql.port}/jobs" in said
    assert "Took over taken-over from" in said
    assert PASSWORD not in said
