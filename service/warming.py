"""Machine code that is loaded, or compiled on first use, before the first request needs it."""

import numpy as np

from slipstick.table.axis import Axis
from slipstick.table.interpolation import interpolate
from slipstick.uncertainty import Inputs
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, converged


def warm() -> None:
    """Compute one small likelihood with the methods that the default table uses: on a lattice, and along lines."""
    axes = tuple(Axis(name, np.linspace(0.5, 1.5, 3), 1.0, "1") for name in ("a", "b"))
    times = np.linspace(0.4, 0.6, 18).reshape(3, 3, 2)

    def model(points: np.ndarray, conditions: object) -> np.ndarray:
        return interpolate(axes, times, points, "clip")

    problem = InferenceProblem(model, None, np.full(2, 0.5), np.full(2, 0.5), np.full(2, 1.5), ("a", "b"),
                               tuple(axis.values for axis in axes))
    for lattices in (True, False):
        converged(problem, Candidate(Inputs(np.ones(2), np.full(2, 0.1)), 0.05), lattices=lattices)
