from itertools import product

import numpy as np
import pytest

from slipstick.clutch.conditions import paper_conditions
from slipstick.clutch.ensemble import shifting_times, signals
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS, Signals
from slipstick.table import Axis, Grid

TRUTH = (("pressure_bias", 1.05), ("initial_position", 0.95))
CONDITIONS = paper_conditions().take([3, 40, 77, 100, 150, 180, 199, 215])


@pytest.fixture(scope="session")
def small_table() -> Grid:
    """8 conditions at 5 x 5 points."""
    model, values = Model(), np.linspace(0.7, 1.3, 5)
    axes = (Axis("pressure_bias", values, 1.6, "bar"), Axis("initial_position", values, 5e-4, "m"))
    points = np.array(list(product(values, values)))
    times, status = shifting_times(model, CONDITIONS, [axis.name for axis in axes], points)
    return Grid(axes, times.reshape(5, 5, 8), status.reshape(5, 5, 8), CONDITIONS, model, "the tests")


@pytest.fixture(scope="session")
def small_recordings() -> Recordings:
    """The same 8 conditions, simulated a little off nominal, each off that by some milliseconds."""
    names, multiples = zip(*TRUTH, strict=True)
    time = np.arange(0.0, 1.5, 0.01)
    response = signals(Model(), CONDITIONS, time, names, np.array([multiples]))
    measured = response.shifting_time[0] + 0.008 * np.random.default_rng(2).standard_normal(8)
    return Recordings(CONDITIONS, measured, Signals(time, *(getattr(response, name)[0] for name in SIGNAL_UNITS)))
