"""Shafts that stick to each other and break away again, simulated and studied as any other machine."""

import numpy as np
import pytest

from slipstick.engine.measured_law import Law, measure
from slipstick.engine.selection import Identification
from slipstick.engine.simulation import simulate_runs
from slipstick.engine.study import identify_runs
from slipstick.machine import Machine, Runs, list_experiments

CLUTCH = Machine.open("dry_clutch")
FALLING = Law(("friction", "slip"), "curve", "", "rad/s", np.array([0.0, 100.0]), np.array([0.15, -0.1]),
              np.zeros((2, 2)), 0)


def record(*laws: Law) -> Runs:
    experiments = list_experiments(CLUTCH)
    return simulate_runs(CLUTCH, experiments.take(np.arange(20) % len(experiments)), seed=4, laws=laws)


def study(*laws: Law) -> Identification:
    return identify_runs(CLUTCH, record(*laws))


def test_plates_stick_under_the_force_and_break_away_at_a_quarter_of_it() -> None:
    signals = simulate_runs(CLUTCH, list_experiments(CLUTCH)).signals
    sticks = signals["input speed"] == signals["output speed"]
    assert sticks.mean() > 0.3
    assert (sticks.any(axis=1) & ~sticks[:, -1]).sum() > 4


def test_nothing_is_named_where_nothing_is_missing() -> None:
    answer = study()
    assert not answer.findings
    assert not answer.unexplained


@pytest.mark.slow
def test_friction_that_falls_with_the_slip_is_named_and_measured() -> None:
    answer = study(FALLING)
    finding, = answer.findings
    assert finding.pair == FALLING.pair
    assert not answer.unexplained
    law = measure(answer.fits[0], FALLING.pair)
    slip = np.linspace(5, 80, 6)
    change, true = np.interp(slip, law.x, law.change), np.interp(slip, FALLING.x, FALLING.change)
    # A relative law is known up to a factor, which the coefficient of friction has.
    np.testing.assert_allclose((1 + change) / (1 + change[0]), (1 + true) / (1 + true[0]), atol=0.01)
