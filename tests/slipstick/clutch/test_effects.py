"""Every effect of the catalogue: as its readable twin says, absent where neutral, visible where typical."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from slipstick.clutch import effects, ensemble, reference
from slipstick.clutch.conditions import Conditions, paper_conditions
from slipstick.clutch.effects.effect import BLOCKS, QUANTITIES, SENSORS, Effect, Signals
from slipstick.clutch.lag import lagged_signal
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, UnknownName

CONDITIONS = replace(paper_conditions(), run_order=np.random.default_rng(4).permutation(216))
SAMPLE_TIMES = np.arange(0.0, 1.8, 0.02)
SIGNALS = ("pressure", "input_speed", "output_speed", "output_torque", "piston_position")
FINEST = ensemble.Accuracy(2e-5, 1e-4)

each_effect = pytest.mark.parametrize("effect", effects.CATALOGUE, ids=lambda effect: effect.name)


def acting(chosen: Iterable[Effect], share: float = 1.0) -> Model:
    """The model with the chosen effects, their amplitudes at a share of what is typical."""
    model = Model()
    for effect in chosen:
        model = model.with_effect(effect.name, {
            c.name: c.typical if c.shape else c.neutral + share * (c.typical - c.neutral) for c in effect.coefficients})
    return model


def stacked(response: ensemble.Response) -> np.ndarray:
    """The signals in one array, (points, conditions, times, signals)."""
    return np.stack([getattr(response, name) for name in SIGNALS], axis=-1)


def distance_to_twin(model: Model, conditions: Conditions, condition: int, times: np.ndarray) -> tuple[float, float]:
    """Largest differences of shifting time in s, and of signals as a share of their range."""
    shifting_time, signals = reference.simulate(model, conditions, condition, times, tolerance=1e-7)
    fast = ensemble.signals(model, conditions.take([condition]), times, accuracy=FINEST)
    apart = np.abs(stacked(fast)[0, 0] - signals).max(axis=0) / np.ptp(signals, axis=0)
    return abs(float(fast.shifting_time[0, 0]) - shifting_time), float(apart.max())


@pytest.mark.parametrize("condition", [77, 215])
@each_effect
def test_agrees_with_the_readable_twin(effect: Effect, condition: int) -> None:
    time, signals = distance_to_twin(acting([effect]), CONDITIONS, condition, SAMPLE_TIMES)
    assert time < 1e-5
    assert signals < 1e-4


def test_all_effects_at_once_agree_with_the_readable_twin_through_slip_stick_release_and_rest() -> None:
    # After lock-up the current falls, the plates let go and the brake stops the load; then all begins again.
    time = np.array([[0, 0.002, 0.105, 0.115, 0.255, 0.8, 1.2, 1.21, 3.2, 3.4, 6.0]])
    current = np.array([[0.1, 0.7, 0.7, 0.3, 0.3, 0.7, 0.7, 0.05, 0.05, 0.5, 0.7]])
    one = np.ones(1)
    again = Conditions(np.zeros(1, np.int64), 105 * one, 6 * one, 80 * one, time, current, 120 * one)
    shifting_time, signals = distance_to_twin(acting(effects.CATALOGUE), again, 0, np.arange(0.0, 6.0, 0.02))
    assert shifting_time < 1e-5
    assert signals < 1e-3  # the shafts swing as the plates let go, and do not swing quite alike


@each_effect
def test_neutral_coefficients_are_bit_identical_to_the_papers_model(effect: Effect) -> None:
    plain = ensemble.signals(Model(), CONDITIONS, SAMPLE_TIMES)
    # The second point makes the effect active for both: the first runs through its formula with neutral values.
    vectors = np.tile(Model().parameters, (2, 1))
    coefficients = np.array([Model().coefficients(), acting([effect]).coefficients()])
    both = ensemble.simulate(vectors, coefficients, CONDITIONS, SAMPLE_TIMES)
    np.testing.assert_array_equal(both.shifting_time[0], plain.shifting_time[0])
    np.testing.assert_array_equal(stacked(both)[0], stacked(plain)[0])


@each_effect
def test_typical_coefficients_show_and_let_every_engagement_lock(effect: Effect) -> None:
    plain = stacked(ensemble.signals(Model(), CONDITIONS, SAMPLE_TIMES))
    response = ensemble.signals(acting([effect]), CONDITIONS, SAMPLE_TIMES)
    assert np.all(response.status == ensemble.LOCKED)
    difference = np.sqrt(np.mean((stacked(response) - plain) ** 2, axis=(0, 1, 2))) / np.ptp(plain, axis=(0, 1, 2))
    assert difference[:4].max() > 2e-3


@each_effect
def test_a_thousandth_of_an_effect_changes_a_thousandth(effect: Effect) -> None:
    times = [ensemble.shifting_times(acting([effect], share), CONDITIONS, accuracy=ensemble.TIGHT)[0]
             for share in (0.0, 1e-3, 1.0)]
    assert np.abs(times[1] - times[0]).max() < 1e-2 * np.abs(times[2] - times[0]).max() + 1e-5


@each_effect
def test_only_effects_that_say_so_depend_on_the_run_order(effect: Effect) -> None:
    backwards = replace(CONDITIONS, run_order=215 - np.asarray(CONDITIONS.run_order))
    there, back = (ensemble.shifting_times(acting([effect]), one)[0] for one in (CONDITIONS, backwards))
    assert np.array_equal(there, back) != effect.uses_run_order
    assert acting([effect]).uses_run_order == effect.uses_run_order
    assert not acting([effect], share=0.0).uses_run_order


def test_default_steps_are_short_enough_for_every_effect() -> None:
    for effect in effects.CATALOGUE:
        default, tight = (ensemble.shifting_times(acting([effect]), CONDITIONS, accuracy=accuracy)[0]
                          for accuracy in (ensemble.DEFAULT, ensemble.TIGHT))
        # A tenth of what the measurement of a shifting time is taken to be off by; seal friction needs 3.6e-4.
        assert np.abs(default - tight).max() < (4e-4 if effect.name == "seal_friction" else 3e-4), effect.name


def test_a_lag_is_exact_for_signals_that_are_straight_between_samples() -> None:
    times = np.array([0.0, 0.004, 0.01, 0.011, 0.03, 0.06])
    values = np.array([[1.0, 3.0, -2.0, -2.0, 5.0, 5.0], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]])
    lags = np.array([[0.007], [0.0]])
    fine = np.linspace(0, 0.06, 600_001)
    straight, state, step = np.interp(fine, times, values[0]), values[0, 0], fine[1]
    slow = [state := state + step / lags[0, 0] * (0.5 * (before + after) - state)
            for before, after in pairwise(straight)]
    behind = lagged_signal(values, times, lags)
    np.testing.assert_allclose(behind[0, 1:], np.interp(times[1:], fine[1:], slow), atol=2e-5)
    np.testing.assert_array_equal(behind[1], values[1])


@pytest.mark.parametrize("effect", [one for one in effects.CATALOGUE
                                    if one.quantity not in SENSORS and one.memory is None],
                         ids=lambda effect: effect.name)
def test_an_effect_hands_on_what_others_on_its_quantity_have_done(effect: Effect) -> None:
    signals = Signals(0.3, 4.0, 2.0, 1e-3, 120.0, 15.0, 70.0, 150.0, 0.6, 1.0, 0.1, 0.5, 0.3, 0.0, 100.0, 1e3, 2.0)
    typical = tuple(one.typical for one in effect.coefficients)
    assert effect.formula(1.01, signals, typical) != effect.formula(1.0, signals, typical)


def test_sensors_change_what_is_read_and_nothing_else() -> None:
    model = Model().with_effect("pressure_sensor_gain", {"gain": 0.1}).with_effect("pressure_sensor_offset",
                                                                                 {"offset": 0.5})
    plain, seen = (ensemble.signals(one, CONDITIONS, SAMPLE_TIMES) for one in (Model(), model))
    # In the order of the catalogue: lag, offset, gain.
    np.testing.assert_allclose(seen.pressure, (plain.pressure + 0.5) * 1.1, rtol=1e-14)
    for name in SIGNALS[1:]:
        np.testing.assert_array_equal(getattr(seen, name), getattr(plain, name))


def test_every_effect_says_what_it_is() -> None:
    assert len(effects.CATALOGUE) >= 30
    assert sorted(quantity for block in BLOCKS.values() for quantity in block) == sorted([*QUANTITIES, *SENSORS])
    for effect in effects.CATALOGUE:
        assert all((effect.title, effect.law, effect.source, effect.signature, effect.unit, effect.block))
        assert not all(c.shape for c in effect.coefficients)
        assert all(c.shape or c.typical != c.neutral for c in effect.coefficients), effect.name


def test_an_effect_that_cannot_work_is_refused_by_its_name() -> None:
    whole = effects.find("thermal_fade")
    for changed, text in (({"quantity": "contact_pressure"}, "Did you mean 'contact pressure'"),
                          ({"coefficients": whole.coefficients * 5}, "no more"),
                          ({"coefficients": (replace(whole.coefficients[0], typical=1e9),)}, "within its bounds")):
        with pytest.raises((InvalidValue, UnknownName), match=text) as refused:
            replace(whole, **changed)
        assert "thermal_fade" in str(refused.value)


@pytest.mark.parametrize("effect", [one for one in effects.CATALOGUE if one.listed], ids=lambda effect: effect.name)
def test_signals_are_finite_on_the_way_to_the_bounds_of_every_amplitude(effect: Effect) -> None:
    # At the very bounds an engagement may blow up, and a study reversals back; before them no formula may.
    few = CONDITIONS.take([0, 77, 150, 215])
    for one in (c for c in effect.coefficients if not c.shape):
        for value in (one.neutral + share * (end - one.neutral) for end in (one.lower, one.upper)
                      for share in (0.25, 0.5, 0.75)):
            values = {c.name: c.typical if c.shape else c.neutral for c in effect.coefficients} | {one.name: value}
            found = ensemble.signals(Model().with_effect(effect.name, values), few, SAMPLE_TIMES)
            assert np.isfinite(stacked(found)).all(), (one.name, value)


@each_effect
def test_every_amplitude_alone_changes_something(effect: Effect) -> None:
    plain = stacked(ensemble.signals(Model(), CONDITIONS, SAMPLE_TIMES))
    for one in (c for c in effect.coefficients if not c.shape):
        values = {c.name: c.typical if c.shape or c is one else c.neutral for c in effect.coefficients}
        changed = stacked(ensemble.signals(Model().with_effect(effect.name, values), CONDITIONS, SAMPLE_TIMES))
        assert np.abs(changed - plain).max() > 0, f"{one.name} is a shape: say shape=True"
