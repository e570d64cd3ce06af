"""Where fits of the simulation begin, and the rows of independent values that they fit."""

from collections.abc import Callable

import numpy as np
import pytest

from slipstick.confirmation import SimulationFit, Terms, Traces
from slipstick.confirmation.fit import fit_given_back, fit_simulation, polished, refit_above
from slipstick.confirmation.simulated import FINE, RANDOM, SimulatedBench
from slipstick.confirmation.starts import About, search_start
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from tests.benches import HEAVY, NOMINAL
from tests.slipstick.confirmation.conftest import recorded

DROOP = 0.15
TERMS = Terms(HEAVY, ("supply_droop",))
"""The line pressure falls with the motor speed, which a valve gain in each engagement makes good."""


@pytest.fixture(scope="module")
def without() -> SimulationFit:
    """The fit without the effect to recordings with it."""
    recordings, _ = recorded(NOMINAL.with_effect("supply_droop", {"droop": DROOP}), 24)
    traces = Traces.of(Scene.of(HEAVY, recordings, NamingSettings()), {}, HEAVY.physics.curves)
    return fit_simulation(traces, Terms(HEAVY), np.zeros((24, len(RANDOM))))


def test_the_start_gives_an_effect_what_parameters_have_taken_of_it(without: SimulationFit) -> None:
    block = SimulatedBench(without.block.traces, TERMS)
    fine = SimulatedBench(without.block.traces, without.block.terms, steps=FINE)
    about = About(fine, without.fitted)
    points, shared = about.start(TERMS, about.taken(TERMS))
    assert block.values(shared)[0] == pytest.approx(DROOP, rel=0.3)
    gain = list(RANDOM).index("current_gain")
    assert points[:, gain].std() < 0.5 * without.fitted.points[:, gain].std()
    _, held = search_start(block, without.fitted.points)
    assert abs(block.values(held)[0]) < 0.4 * DROOP  # with the parameters held it seems to do little


def test_parameters_beside_a_law_give_back_the_constant_up_to_which_it_is_known(without: SimulationFit) -> None:
    block, gain = SimulatedBench(without.block.traces, TERMS), list(RANDOM).index("current_gain")
    motor_speed = without.block.scene.recordings.conditions.motor_speed
    law = -DROOP * (200 / motor_speed - 1)
    points = np.zeros_like(without.fitted.points)
    points[:, gain] = law.mean()  # as a block has them beside a law of mean 0
    fine = SimulatedBench(without.block.traces, without.block.terms, steps=FINE)
    begun, shared = search_start(block, points, About(fine, without.fitted).taken(TERMS).mean(axis=0))
    assert block.values(shared)[0] == pytest.approx(DROOP)  # three times the typical value, which is tried
    assert np.abs(begun[:, gain]).max() < 0.3 * abs(law.mean())
    assert abs(block.values(search_start(block, points)[1])[0]) < 0.5 * DROOP


def test_the_fit_from_there_finds_the_effect(without: SimulationFit) -> None:
    """From the fit without it, with what is left of the effect in the parameters, no step leads to the effect."""
    found = fit_given_back(without, TERMS)
    assert found.values[0] == pytest.approx(DROOP, rel=0.25)
    assert found.evidence.sum() > without.evidence.sum() + 12
    held = fit_simulation(without.block.traces, TERMS, without.fitted.points)
    assert abs(held.values[0]) < 0.1 * DROOP
    assert held.evidence.sum() < without.evidence.sum() + 12
    assert refit_above(held, without).evidence.sum() >= found.evidence.sum()


def test_a_polished_fit_is_never_below_and_knows_what_differs_between_engagements_as_well_as_they_scatter(
        without: SimulationFit) -> None:
    rough = fit_given_back(without, TERMS)
    found = polished(rough)
    assert found.evidence.sum() >= rough.evidence.sum()
    # The gain of the valve scatters by 1 %, and the effect changes it by up to 0.9 of itself.
    least = 0.5 * 0.01 / np.sqrt(len(without.fitted.points))
    errors = [float(np.sqrt(one.covariance[0, 0])) for one in (rough, found)]
    assert errors[0] < least < errors[1]


def test_a_start_is_within_the_bounds_of_the_coefficients(without: SimulationFit) -> None:
    terms = Terms(HEAVY, ("supply_droop", "stribeck_friction"))
    block = SimulatedBench(without.block.traces, terms)
    about = About(without.block, without.fitted)
    _, shared = about.start(terms, about.taken(terms))
    assert np.all((block.bounds[0] <= shared) & (shared <= block.bounds[1]))


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
