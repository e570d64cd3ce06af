"""docs/your_bench.md from section 7 on: a folder of MDF4 files becomes recordings, a calibration and a study."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.recordings import Recordings, Signals
from slipstick.recordings.signals import SIGNAL_UNITS
from tests.benches import TABLES

pytestmark = pytest.mark.slow
PAGE = (Path(__file__).parents[2] / "docs" / "your_bench.md").read_text().split("## 7.")[1]
COMMANDS = "".join(re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL))
FEW = np.linspace(0, 89, 24).astype(int)  # as many engagements as a study needs
THIN = slice(None, None, 4)  # samples: a study of all of them takes longer than the test is worth


def few_recordings() -> Recordings:
    whole = Recordings.open(TABLES / "measured-compact.h5")
    assert whole.signals is not None
    signals = Signals(whole.signals.time[THIN], *(whole.signals[name][FEW][:, THIN] for name in SIGNAL_UNITS))
    conditions = replace(whole.conditions.take(FEW), run_order=None)
    return Recordings(conditions, whole.measured_time[FEW], signals)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which the commands were run."""
    folder = tmp_path_factory.mktemp("project")
    for name in ("tables", "docs", "var", "bin"):
        (folder / name).mkdir()
    shutil.copy(TABLES / "compact.toml", folder / "tables" / "mine.toml")
    shutil.copy(TABLES.parent / "docs" / "bench_files.py", folder / "docs")
    (folder / "tables" / "measured-compact.h5").write_bytes(few_recordings().to_bytes())
    (folder / "bin" / "python").write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    (folder / "bin" / "python").chmod(0o755)
    paths = folder / "bin", Path(sys.executable).parent, os.environ["PATH"]
    environment = {**os.environ, "PATH": ":".join(map(str, paths)), "PYTHONPATH": str(TABLES.parent)}
    done = subprocess.run(["bash", "-c", "set -e -o pipefail\n" + COMMANDS], cwd=folder, env=environment,
                          capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    (folder / "log").write_text(done.stdout)
    return folder


def test_the_import_gives_back_what_the_files_were_made_of(folder: Path) -> None:
    given, found = few_recordings(), Recordings.open(folder / "tables" / "imported.h5")
    assert given.signals is not None
    assert found.signals is not None
    for name in SIGNAL_UNITS:  # the files have the clock of the bench, so that every sample comes back
        np.testing.assert_allclose(found.signals[name], given.signals[name], atol=1e-6, err_msg=name)
    assert np.abs(found.measured_time - given.measured_time).max() < 0.01
    assert found.conditions.current_profile.tolist() == given.conditions.current_profile.tolist()
    for name in ("motor_speed", "load_inertia", "brake_torque"):
        np.testing.assert_allclose(getattr(found.conditions, name), getattr(given.conditions, name), rtol=1e-3)
    assert found.further["oil_temperature"].unit == "°C"


def test_the_walkthrough_ends_with_a_calibration_and_a_study(folder: Path) -> None:
    log = (folder / "log").read_text()
    assert "to be filled in: load_inertia, brake_torque" in log
    assert "24 engagements imported, 0 set aside" in log
    assert "24 engagements imported" in (folder / "tables" / "imported.html").read_text()
    assert json.loads((folder / "var" / "imported.json").read_text())["model"]
    assert "<html" in (folder / "var" / "study.html").read_text()
    assert json.loads((folder / "var" / "study.json").read_text())["result"]
