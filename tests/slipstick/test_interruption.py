"""Ctrl-C ends a program in one line with exit status 130, at whatever point, and its processes without a word."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from slipstick.interruption import STATUS

ROOT = Path(__file__).parents[2]
SLOW = """
import time

def output(a, b):
    time.sleep(0.05)
    return a * b
"""
MACHINE = """
title = "A slow function"
simulator = { callable = "slow_product:output" }
output = { name = "c", unit = "m" }
inputs.a = { nominal = 1, range = [0.5, 1.5], points = 1000 }
conditions.b = [1, 2, 3]
"""


def imports_numpy(process: subprocess.Popen[str], said: Path) -> bool:
    return "multiarray" in Path(f"/proc/{process.pid}/maps").read_text()


def says(text: str) -> Callable[[subprocess.Popen[str], Path], bool]:
    return lambda process, said: text in said.read_text()


@pytest.mark.parametrize(("command", "when", "last"), [
    pytest.param("worker study sample", imports_numpy, "Interrupted.", marks=pytest.mark.slow),
    ("worker study sample", says("step 1"), "Interrupted."),
    pytest.param("worker build --out OUT/table.h5", imports_numpy, "Interrupted.", marks=pytest.mark.slow),
    ("worker build --machine OUT/machine.toml --threads 2 --out OUT/table.h5", says(" runs"), "Stopped. Run the same"),
    pytest.param("worker work --no-compile --jobs sqlite:///OUT/jobs.sqlite", imports_numpy, "Interrupted.",
                 marks=pytest.mark.slow),
    ("worker work --no-compile --jobs sqlite:///OUT/jobs.sqlite", says("is waiting"), "Stopped. Another"),
    pytest.param("service", imports_numpy, "Interrupted.", marks=pytest.mark.slow),
    ("service", says("running on"), "Interrupted."),
])
def test_an_interrupted_program_ends_in_one_line(command: str, when: Callable[[subprocess.Popen[str], Path], bool],
                                                 last: str, tmp_path: Path) -> None:
    (tmp_path / "slow_product.py").write_text(SLOW)
    (tmp_path / "machine.toml").write_text(MACHINE)
    environment = {**os.environ, "SLIPSTICK_JOBS": f"sqlite:///{tmp_path}/jobs.sqlite", "SLIPSTICK_PORT": "0"}
    said = tmp_path / "said"
    with said.open("w") as output:
        process = subprocess.Popen([sys.executable, "-m", *command.replace("OUT", str(tmp_path)).split()], cwd=ROOT,
                                   stdout=output, stderr=output, text=True, env=environment, start_new_session=True)
    try:
        while not when(process, said):
            assert process.poll() is None, said.read_text()
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        assert process.wait(timeout=20) == STATUS
    finally:
        process.kill()
    time.sleep(0.3)  # in which processes of the program would say something
    text = said.read_text()
    assert text.splitlines()[-1].startswith(last)
    for unwanted in ("Traceback", "Process ", "KeyboardInterrupt", "Exception"):
        assert unwanted not in text
