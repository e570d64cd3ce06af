"""Where fits of the simulation begin, and the rows of independent values that they fit."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from slipstick.confirmation import SimulationFit, Terms, Traces
from slipstick.confirmation.fit import fit_simulation
from slipstick.confirmation.simulated import RANDOM, SimulatedBench
from slipstick.confirmation.starts import About, search_start
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from tests.benches import HEAVY, NOMINAL
from tests.slipstick.confirmation.conftest import SCATTER, recorded

DROOP = 0.15
TERMS = Terms(HEAVY, ("supply_droop",))
"""The line pressure falls with the motor speed, which a valve gain in each engagement makes good."""


@pytest.fixture(scope="module")
def without() -> SimulationFit:
    """The fit without the effect to recordings with it."""
    recordings, _ = recorded(NOMINAL.with_effect("supply_droop", {"droop": DROOP}), 24)
    traces = Traces.of(Scene.of(HEAVY, recordings, NamingSettings()), {}, HEAVY.physics.curves)
    return fit_simulation(traces, Terms(HEAVY), np.zeros((24, len(RANDOM))))


@pytest.mark.slow
def test_parameters_beside_a_law_give_back_the_constant_up_to_which_it_is_known(without: SimulationFit) -> None:
    block, gain = SimulatedBench(without.block.traces, TERMS), list(RANDOM).index("current_gain")
    motor_speed = without.block.scene.recordings.conditions.motor_speed
    law = -DROOP * (200 / motor_speed - 1)
    points = np.zeros_like(without.fitted.points)
    points[:, gain] = law.mean()  # as a block has them beside a law of mean 0
    begun, shared = search_start(block, points, About(without.block, without.fitted).taken(TERMS).mean(axis=0))
    assert block.values(shared)[0] == pytest.approx(DROOP)  # three times the typical value, which is tried
    assert np.abs(begun[:, gain]).max() < 0.3 * abs(law.mean())
    assert abs(block.values(search_start(block, points)[1])[0]) < 0.5 * DROOP


def test_a_fit_finds_an_effect_that_parameters_have_taken_and_its_error_is_that_of_their_scatter(
        without: SimulationFit) -> None:
    """The effect differs between engagements only: what differs in them by chance is how well it can be known."""
    fit = fit_simulation(without.block.traces, TERMS, without.fitted.points)
    motor_speed = without.block.scene.recordings.conditions.motor_speed
    scatter = np.hypot(SCATTER["current_gain"], SCATTER["pressure_bias"] * 0.1)
    least = scatter / np.sqrt(len(motor_speed)) / np.std(200 / motor_speed)
    error = float(np.sqrt(fit.covariance[0, 0]))
    assert 0.3 * least < error < 4 * least  # the scatter of 24 engagements is known roughly
    assert fit.values[0] == pytest.approx(DROOP, abs=3 * error)
    assert fit.evidence.sum() > without.evidence.sum() + 12


def test_differences_do_not_tell_an_effect_from_parameters_that_do_the_same(without: SimulationFit) -> None:
    """A droop is a smaller gain and a smaller bias within an engagement."""
    points, shared = np.zeros_like(without.fitted.points), np.zeros(1 + len(without.block.traces.signals))
    left = {}
    for rough in (True, False):
        block = SimulatedBench(without.block.traces, TERMS, rough=rough).at(shared)
        own, fixed = block.columns(points, (), block.base(points))
        each = [effect - parameters.T @ np.linalg.lstsq(parameters.T, effect, rcond=1e-12)[0]
                for parameters, effect in zip(own * block.counted[:, None], fixed[:, 0] * block.counted, strict=True)]
        # Of a change of the pressure by 1 %, which is the scatter of the gain, in standard errors of an engagement.
        left[rough] = 0.01 / TERMS.unknowns[0].span * float(np.sqrt(np.mean(np.square(each).sum(axis=1))))
    assert left[False] < 0.1
    assert left[False] < 0.2 * left[True]


# Rows of independent values: noise becomes white with unit variance, and simulations of the truth leave only it.


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


def test_the_clock_of_a_signal_is_fitted_beside_the_lag_of_its_sensor(traced: Traced) -> None:
    """Where the blocks have left a part of the lag to the clock, the fit gives it back."""
    lag = 0.01
    traces, points = traced(NOMINAL.with_effect("input_speed_sensor_lag", {"lag": lag}))
    late = replace(traces, clocks={"input_speed": 0.4 * lag})
    fit = fit_simulation(late, Terms(HEAVY, ("input_speed_sensor_lag",)), points)
    error = float(np.sqrt(fit.covariance[0, 0]))
    assert fit.values[0] == pytest.approx(lag, abs=4 * error)
    assert 1e-5 < error < 0.02 * lag
    clock = fit.fitted.shared[fit.block.clocks][traces.signals.index("input_speed")] * traces.scene.step
    assert clock == pytest.approx(0, abs=0.02 * lag)
