import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from slipstick.clutch.conditions import paper_conditions
from slipstick.clutch.ensemble import shifting_times
from slipstick.clutch.model import Model
from slipstick.table import Axis, Table

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small real table, `nominal`, and the shipped recordings, `measured`."""
    folder = tmp_path_factory.mktemp("tables")
    model, conditions, grid = Model(), paper_conditions(), np.linspace(0.5, 1.5, 9)
    axes = (Axis("pressure_bias", grid, 1.6, "bar"), Axis("initial_position", grid, 5e-4, "m"))
    times, status = shifting_times(model, conditions, [axis.name for axis in axes], np.array(list(product(grid, grid))))
    shape = (len(grid), len(grid), len(conditions))
    table = Table(axes, times.reshape(shape), status.reshape(shape), conditions, model, "the tests")
    table.write(folder / "nominal.h5")
    shutil.copy(ROOT / "tables" / "measured.h5", folder)
    return folder


@pytest.fixture(scope="session")
def launch() -> Iterator[Callable[..., subprocess.Popen[bytes]]]:
    """Start `python -m ...` as a process of its own; what still runs at the end is killed."""
    started: list[subprocess.Popen[bytes]] = []

    def start(*arguments: str, **environment: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", *arguments]
        started.append(subprocess.Popen(command, cwd=ROOT, env={**os.environ, **environment}))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()
