import numpy as np
import pytest

from slipstick.table import Axis, Grid
from tests.benches import HEAVY, NOMINAL


@pytest.fixture
def table():
    """A table of 3 conditions on a grid of 7 x 5 points; one engagement never locked and one failed."""
    axes = (Axis("pressure_bias", np.linspace(0.5, 1.5, 7), 1.6, "bar"),
            Axis("initial_position", np.array([0.5, 0.8, 0.9, 1.2, 1.5]), 5e-4, "m"))
    times = np.random.default_rng(1).uniform(0.5, 1.5, (7, 5, 3))
    status = np.zeros((7, 5, 3), dtype=np.uint8)
    status[6, 4, 0], status[0, 0, 2] = 1, 2
    times[status != 0] = np.nan
    return Grid(axes, times, status, HEAVY.conditions.take([3, 100, 215]), NOMINAL, "a test")
