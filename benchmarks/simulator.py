"""The simulator and its peers, over the default grid of 540,000 engagements.

The tolerance of each method is chosen for an error of about 1e-4 s against the tight ensemble. Times are those of every
25th point of the grid, on one core; scipy's is of twelve engagements, scaled to as many.
"""

import subprocess
import sys
from collections.abc import Callable
from functools import cache

import numpy as np

from benchmarks import scipy_script
from benchmarks.benches import AXES, HEAVY, make_grid
from slipstick.bench import parameters
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model

DOPRI_TOLERANCE, DIFFRAX_TOLERANCE, SCIPY_TOLERANCE = 1e-6, 1e-5, 3e-4
SCIPY_RUNS = [(point, condition) for point in (0, 1275, 2499) for condition in range(4, 216, 54)]
CONDITIONS, MODEL, GRID = HEAVY.conditions, Model(HEAVY.physics), make_grid(50)
SUBSET = np.arange(0, len(GRID), 25)


@cache
def tight() -> np.ndarray:
    """Shifting times (2500, 216) in s with much smaller steps."""
    return ensemble.shifting_times(MODEL, CONDITIONS, AXES, GRID, ensemble.TIGHT)[0]


def one_core() -> np.ndarray:
    return ensemble.shifting_times(MODEL, CONDITIONS, AXES, GRID[SUBSET], threads=1)[0]


def simulate(code: Callable[..., np.ndarray], tolerance: float, rows: np.ndarray = SUBSET) -> np.ndarray:
    """Shifting times of rows of the grid by another code: `shifting_times` of `scalar_dopri` or of a similar module."""
    vectors = np.tile(MODEL.parameters, (len(rows), 1))
    for column, name in enumerate(AXES):
        vectors[:, parameters.index(name)] *= GRID[rows, column]
    initial, speed = ensemble.initial_input_speed(HEAVY.physics.converter, vectors, CONDITIONS)
    return code(
        vectors, CONDITIONS.current_profile, CONDITIONS.profile_time, CONDITIONS.profile_current,
        CONDITIONS.motor_speed, CONDITIONS.load_inertia, CONDITIONS.brake_torque, initial[:, speed], tolerance)


def script() -> np.ndarray:
    times = []
    for point, condition in SCIPY_RUNS:
        factors = dict(zip(AXES, GRID[point], strict=True))
        p = {name: value * factors.get(name, 1.0)
             for name, value in zip(parameters.NAMES, MODEL.parameters, strict=True)}
        times.append(scipy_script.shifting_time(p, CONDITIONS, condition, SCIPY_TOLERANCE))
    return np.array(times)


def ensemble_error() -> float:
    """Largest error in s over the grid."""
    return float(np.abs(ensemble.shifting_times(MODEL, CONDITIONS, AXES, GRID)[0] - tight()).max())


def simulated_error(code: Callable[..., np.ndarray], tolerance: float) -> float:
    """Largest error in s over the grid."""
    return float(np.abs(simulate(code, tolerance, np.arange(len(GRID))) - tight()).max())


def script_error() -> float:
    """Largest error in s over the twelve engagements."""
    return float(np.abs(script() - [tight()[run] for run in SCIPY_RUNS]).max())


class CatalogueProcess:
    """The ensemble in a separate process: with the `full` or the `bare` catalogue, or with `three` active effects."""

    def __init__(self, catalogue: str) -> None:
        self.process = subprocess.Popen([sys.executable, "-m", "benchmarks.catalogue", catalogue], text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self.process.stdout
        self.process.stdout.readline()

    def run(self) -> None:
        """Run the ensemble once."""
        assert self.process.stdin
        assert self.process.stdout
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        self.process.stdout.readline()
