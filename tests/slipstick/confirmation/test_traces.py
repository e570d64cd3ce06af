"""Rows of independent values: noise becomes white with unit variance, and simulations of the truth leave only it."""

from collections.abc import Callable

import numpy as np
import pytest

from slipstick.confirmation import Terms, Traces
from slipstick.confirmation.simulated import SimulatedBench
from tests.benches import HEAVY, NOMINAL

Traced = Callable[..., tuple[Traces, np.ndarray]]


def test_the_truth_leaves_white_noise_of_unit_variance(traced: Traced) -> None:
    traces, points = traced(NOMINAL)
    left = np.where(traces.counted, traces.measured - SimulatedBench(traces, Terms(HEAVY)).base(points), np.nan)
    for name, columns in traces.columns.items():
        its = left[:, columns]
        # Third differences of the signals tell the noise to some ten percent, slow parts of it to a half; there are
        # only 18 shifting times.
        assert np.nanmean(its**2) == pytest.approx(1.0, abs=1.0 if name == "shifting_time" else 0.5), name
        if name != "shifting_time":
            assert abs(np.nanmean(its[:, 1:] * its[:, :-1])) < 0.15, name
    assert traces.mean_squares(np.nan_to_num(left)).keys() == set(traces.channels)


def test_only_torque_near_lock_up_does_not_count(traced: Traced) -> None:
    traces, _ = traced(NOMINAL)
    left_out = {name: int((~traces.counted[:, columns]).sum()) for name, columns in traces.columns.items()}
    assert left_out.pop("output_torque") >= len(traces.scene)
    assert set(left_out.values()) == {0}


def test_noise_is_what_a_fit_leaves_and_that_of_the_timer_at_least_what_is_stated(traced: Traced) -> None:
    traces, _ = traced(NOMINAL)
    wide = traces.with_noise({name: 4.0 if name == "pressure" else 0.25 for name in traces.channels})
    assert wide.noise["pressure"] == 2.0
    assert wide.noise["input_speed"] == 0.5
    assert wide.noise["shifting_time"] == 1.0
    pressure = traces.columns["pressure"]
    np.testing.assert_allclose(2 * wide.measured[:, pressure], traces.measured[:, pressure])


def test_a_late_clock_shifts_a_signal(traced: Traced) -> None:
    traces, points = traced(NOMINAL)
    late = Traces.of(traces.scene, {"input_speed": 1e-3}, HEAVY.physics.curves)
    change = [SimulatedBench(one, Terms(HEAVY)).base(points) for one in (traces, late)]
    moved = (change[1] - change[0])[:, traces.columns["input_speed"]]
    assert np.abs(moved).max() > 1
    assert np.array_equal(change[0][:, traces.columns["pressure"]], change[1][:, traces.columns["pressure"]])
