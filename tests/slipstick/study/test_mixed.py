"""Recordings made with the simulator itself: what went in comes out."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.clutch import ensemble
from slipstick.clutch.laws import MeasuredLaw
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS, Signals
from slipstick.study import mixed
from slipstick.study.comparison import Comparison, compare
from slipstick.study.design import Design
from slipstick.study.linearised import predict_at
from tests.benches import HEAVY

PARAMETERS = ("pressure_bias", "temperature_gain", "initial_position", "friction_coefficient")
DESIGN = Design(HEAVY, PARAMETERS, (0, 2))
TRUE = np.array([1.1, 0.9, 1.1, 0.97])
STD = np.array([0.05, 0.08])


@pytest.fixture(scope="module")
def recorded() -> Comparison:
    """24 engagements, scattered from run to run, with noise of 1 % of each signal's range."""
    rng, conditions = np.random.default_rng(7), HEAVY.conditions.take(np.arange(0, 216, 9))
    points = np.tile(TRUE, (24, 1))
    points[:, [0, 2]] += STD * rng.standard_normal((24, 2))
    time = np.arange(0.0, 2.0, 0.002)
    response = ensemble.simulate(HEAVY.physics.converter, *DESIGN.vectors(points), conditions, time, paired=True)
    assert np.all(response.status == ensemble.LOCKED)
    read = {name: getattr(response, name) for name in SIGNAL_UNITS}
    noisy = {name: one + 0.01 * np.ptp(one) * rng.standard_normal(one.shape) for name, one in read.items()}
    times = response.shifting_time + 0.003 * rng.standard_normal(24)
    return compare(HEAVY, Recordings(conditions, times, Signals(time, **noisy)), 0.003)


def test_a_fit_finds_its_place_in_the_valley_and_the_scatter(recorded: Comparison) -> None:
    found = mixed.fit(recorded, DESIGN)
    assert found.converged
    off = np.abs(found.state.theta - TRUE)
    assert np.all(off < (0.06, 0.02, 0.06, 0.002)), found.state.theta
    np.testing.assert_allclose(np.sqrt(np.diag(found.scatter)), STD, rtol=0.5)
    np.testing.assert_allclose(found.state.noise, 1, atol=0.2)


def test_beside_a_wrong_temperature_gain_the_likelihood_is_lower(recorded: Comparison) -> None:
    start = np.array([1.0, 1.0, 1.0, 1.0])
    held, found = (mixed.fit(recorded, DESIGN, start, profiled=profiled) for profiled in (False, True))
    assert held.state.theta[1] == pytest.approx(1.0)
    assert held.log_likelihood.sum() < found.log_likelihood.sum() - 10


def test_predictions_have_the_measured_laws_of_the_design(recorded: Comparison) -> None:
    law = MeasuredLaw("load torque", "output speed", (0.0, 60.0), (0.0, 30.0), relative=False)
    points = np.tile(TRUE, (24, 1))
    without, found = (predict_at(recorded, design, points[None])[0]
                      for design in (DESIGN, replace(DESIGN, laws=(law,))))
    response = ensemble.simulate(HEAVY.physics.converter, *DESIGN.vectors(points), recorded.recordings.conditions,
                                 recorded.times, paired=True, laws=(law,))
    np.testing.assert_array_equal(found, recorded.predicted(response))
    assert not np.array_equal(found, without)
