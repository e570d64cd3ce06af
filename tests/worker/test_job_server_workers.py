"""Workers on a PostgreSQL server: killed workers and a killed server lose no job; a backup is restored."""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from job_processes import ENDLESS, SHORT, Bench, ended, in_stage
from test_serve_jobs import uninterrupted

from tests import postgresql as postgresql_server
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

    help_text = subprocess.run([sys.executable, "-m", "worker", "work", "--help"], capture_output=True, text=True,
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


# The commands of docs/operations.md back up jobs and tables in the middle of a fit, and restore them.


ROOT = Path(__file__).parents[2]
SHORTER = {**ENDLESS, "generations": 100, "patience": 100, "refine": False, "intervals": False}


def commands(before: str) -> str:
    """The block of commands after this line of the page."""
    page = (ROOT / "docs" / "operations.md").read_text()
    start = page.index("## Backup and restore")
    block = re.search(r"\n\n((?:    .+\n)+)", page[page.index(before, start):])
    assert block
    return block[1]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "backup", "restore"), [
    ("sqlite", "With SQLite, a copy", "With SQLite:"),
    ("postgresql", "Back up the job database first", "which `SLIPSTICK_JOBS` points")])
def test_a_restored_backup_has_the_results_and_goes_on(
        kind: str, backup: str, restore: str, shelf: Path, few_recordings: Path, tmp_path: Path,
        launch: Callable[..., subprocess.Popen[bytes]], request: pytest.FixtureRequest) -> None:
    (tmp_path / "var").mkdir()
    url = [f"sqlite:///{tmp_path}/var/jobs.sqlite"] * 2
    programs = Path(".")
    if kind == "postgresql":
        server = request.getfixturevalue("postgresql")
        url = [server.url("before"), server.url("after")]
        programs = Path(str(postgresql_server.program("pg_dump"))).parent
    bench = Bench(shelf, few_recordings / "few.h5", tmp_path, launch, url[0])

    def run(lines: str, url: str, tables: Path) -> None:
        environment = {**os.environ, "SLIPSTICK_JOBS": url, "SLIPSTICK_TABLES": str(tables),
                       "PATH": f"{Path(sys.executable).parent}:{programs}:{os.environ['PATH']}"}
        subprocess.run(["bash", "-euc", lines], cwd=tmp_path, env=environment, check=True)

    bench.submit("short", **SHORT)
    assert bench.follow("short", ended)["status"] == "done"
    result = bench.client.get("/v1/fits/short/result").json()
    bench.submit("running", **SHORTER)
    bench.follow("running", in_stage("search", 2))
    run(commands(backup), url[0], bench.tables)
    bench.kill(bench.worker, bench.service)

    (tmp_path / "restored").mkdir()
    run(commands(restore), url[1], tmp_path / "restored")
    assert {path.name for path in (tmp_path / "restored").iterdir()} == {path.name for path in bench.tables.iterdir()}
    bench.environment |= {"SLIPSTICK_JOBS": url[1], "SLIPSTICK_TABLES": str(tmp_path / "restored")}
    bench.serve()
    assert bench.client.get("/v1/fits/short/result").json() == result
    cut = bench.client.get("/v1/fits/running").json()
    assert (cut["status"], cut["progress"]["generation"] < 100) == ("running", True)
    bench.work()
    assert bench.follow("running", ended)["status"] == "done"
    found = bench.client.get("/v1/fits/running/result").json()["result"]
    assert found == json.loads(json.dumps(uninterrupted(shelf, **SHORTER)))
    bench.kill(bench.worker, bench.service)
