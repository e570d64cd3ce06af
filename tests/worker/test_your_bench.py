"""docs/your_bench.md: its commands are executed as written, on a part of the recordings."""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import h5py
import pytest

from slipstick.bench import Bench
from slipstick.table import Table
from tests.benches import COMPACT, TABLES

pytestmark = pytest.mark.slow
PAGE = (Path(__file__).parents[2] / "docs" / "your_bench.md").read_text()
COMMANDS = "".join(re.findall(r"```sh\n(.*?)```", PAGE.split("## 7.")[0], re.DOTALL))
"""Those after section 7 are executed by test_your_files.py."""


def few_recordings(out: Path) -> None:
    """Every sixth engagement of the compact bench: fifteen, and a calibration needs fourteen."""
    with h5py.File(TABLES / "measured-compact.h5") as shipped, h5py.File(out, "w") as few:
        def take(name: str, item: object) -> None:
            if isinstance(item, h5py.Dataset):
                shared = name.startswith("current_profiles") or name == "signals/time"
                few[name] = item[:] if shared else item[::6]
                few[name].attrs["units"] = item.attrs["units"]

        shipped.visititems(take)
        few.pop("conditions/run_order", None)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which the commands were run."""
    folder, port = tmp_path_factory.mktemp("project"), free_port()
    (folder / "tables").mkdir()
    shutil.copy(TABLES / "compact.toml", folder / "tables")
    few_recordings(folder / "tables" / "measured-compact.h5")
    (folder / "bin").mkdir()
    (folder / "bin" / "python").write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    (folder / "bin" / "python").chmod(0o755)
    script = "set -e -o pipefail\n" + COMMANDS.replace("127.0.0.1:8000", f"127.0.0.1:{port}")
    paths = folder / "bin", Path(sys.executable).parent, os.environ["PATH"]
    environment = {**os.environ, "PATH": ":".join(map(str, paths)), "SLIPSTICK_PORT": str(port),
                   "PYTHONPATH": str(TABLES.parent)}
    with (folder / "log").open("w") as log:
        process = subprocess.Popen(["bash", "-c", script], cwd=folder, env=environment, stdout=log, stderr=log,
                                   start_new_session=True)
        try:
            status = process.wait(timeout=300)
        finally:
            with suppress(ProcessLookupError):  # after a failure, service and worker of the script are still running
                os.killpg(process.pid, signal.SIGTERM)
    assert status == 0, (folder / "log").read_text()
    return folder


def test_the_commands_go_from_a_template_to_a_fit(folder: Path) -> None:
    log = (folder / "log").read_text()
    assert "Wrote tables/mine.toml" in log
    assert "90 conditions: 90 locked" in log
    assert "Nothing implausible was found" in log
    assert (folder / "tables" / "mine.svg").read_text().startswith("<svg")
    assert Bench.open(folder / "tables" / "mine.toml").digest == COMPACT.digest
    model = Table.open(folder / "tables" / "mine.h5").model
    assert model.physics == COMPACT.physics
    assert model.parameters != COMPACT.physics.nominal  # it is the calibrated one
    assert "<html" in (folder / "var" / "fit.html").read_text()


def test_the_fit_has_its_physical_values(folder: Path) -> None:
    result = json.loads((folder / "var" / "fit.json").read_text())
    model = json.loads((folder / "var" / "mine.json").read_text())["model"]
    physical, = result["physical"]
    nominal = model["parameters"]["initial_position"]
    assert (physical["name"], physical["unit"], physical["nominal"]) == ("initial_position", "m", nominal)
    assert physical["mean"] == pytest.approx(nominal * result["result"]["mean"][0])
    assert physical["std"] == pytest.approx(nominal * result["result"]["std"][0])


@pytest.mark.parametrize("part", re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL), ids=lambda part: part.split()[0])
def test_the_parts_shown_are_those_of_the_compact_bench(part: str) -> None:
    assert part in (TABLES / "compact.toml").read_text()
