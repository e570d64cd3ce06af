"""The commands of docs/operations.md back up jobs and tables in the middle of a fit, and restore them."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from test_serve_jobs import ENDLESS, SHORT, Bench, ended, in_stage, uninterrupted

from tests import postgresql as postgresql_server

ROOT = Path(__file__).parents[2]
LONG = {**ENDLESS, "generations": 100, "patience": 100, "refine": False, "intervals": False}


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
    ("postgresql", "Service and workers may run meanwhile", "which `SLIPSTICK_JOBS` points")])
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
    bench.submit("running", **LONG)
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
    assert found == json.loads(json.dumps(uninterrupted(shelf, **LONG)))
    bench.kill(bench.worker, bench.service)
