"""Every effect of the catalogue: agreement with the reference, absence when neutral, visibility when typical."""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.bench.conditions import Conditions
from slipstick.clutch import effects, ensemble, reference
from slipstick.clutch.effects.effect import BLOCKS, QUANTITIES, SENSORS, Effect, Signals
from slipstick.clutch.lag import lagged_signal
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, UnknownName
from tests.benches import BENCHES, COMPACT, HEAVY, NOMINAL

ON_HEAVY = tuple(effect.on(HEAVY.scales) for effect in effects.CATALOGUE)
CONDITIONS = replace(HEAVY.conditions, run_order=np.random.default_rng(4).permutation(216))
FEW = CONDITIONS.take(range(0, 216, 9))
SAMPLE_TIMES = np.arange(0.0, 1.8, 0.02)
SIGNALS = ("pressure", "input_speed", "output_speed", "output_torque", "piston_position")
FINEST = ensemble.Accuracy(2e-5, 1e-4)

each_effect = pytest.mark.parametrize("effect", ON_HEAVY, ids=lambda effect: effect.name)


def with_effects(added: Iterable[Effect], fraction: float = 1.0, model: Model = NOMINAL) -> Model:
    """A model with effects of its bench added, their amplitudes at a fraction of their typical values."""
    for effect in added:
        model = model.with_effect(effect.name, {
            c.name: c.typical if c.shape else c.neutral + fraction * (c.typical - c.neutral)
            for c in effect.coefficients})
    return model


def stacked(response: ensemble.Response) -> np.ndarray:
    """The signals in one array, (points, conditions, times, signals)."""
    return np.stack([getattr(response, name) for name in SIGNALS], axis=-1)


def reference_errors(model: Model, conditions: Conditions, condition: int, times: np.ndarray) -> tuple[float, float]:
    """Largest errors against the reference: shifting time in s, signals as a fraction of their range."""
    shifting_time, signals = reference.simulate(model, conditions, condition, times, tolerance=1e-7)
    fast = ensemble.signals(model, conditions.take([condition]), times, accuracy=FINEST)
    errors = np.abs(stacked(fast)[0, 0] - signals).max(axis=0) / np.ptp(signals, axis=0)
    return abs(float(fast.shifting_time[0, 0]) - shifting_time), float(errors.max())


@pytest.mark.parametrize(("condition", "end"), [(77, 0.8), pytest.param(215, 1.8, marks=pytest.mark.slow)])
@each_effect
def test_agrees_with_the_reference_implementation(effect: Effect, condition: int, end: float) -> None:
    time, signals = reference_errors(with_effects([effect]), CONDITIONS, condition, np.arange(0.0, end, 0.02))
    assert time < 1e-5
    assert signals < 1e-4


@pytest.mark.slow
def test_all_effects_together_agree_with_the_reference_in_slip_stick_and_rest() -> None:
    # After lock-up the current falls, the plates release and the brake stops the load; then it engages again.
    time = np.array([[0, 0.002, 0.105, 0.115, 0.255, 0.8, 1.2, 1.21, 3.2, 3.4, 6.0]])
    current = np.array([[0.1, 0.7, 0.7, 0.3, 0.3, 0.7, 0.7, 0.05, 0.05, 0.5, 0.7]])
    ones = np.ones(1)
    conditions = Conditions(np.zeros(1, np.int64), 105 * ones, 6 * ones, 80 * ones, time, current, 120 * ones)
    shifting_time, signals = reference_errors(with_effects(ON_HEAVY), conditions, 0,
                                              np.arange(0.0, 6.0, 0.02))
    assert shifting_time < 1e-5
    assert signals < 1e-3  # shaft oscillations after release differ slightly in phase


@each_effect
def test_neutral_coefficients_are_bit_identical_to_the_papers_model(effect: Effect) -> None:
    baseline = ensemble.signals(NOMINAL, FEW, SAMPLE_TIMES)
    # The second point makes the effect active for both points, so the formula runs with neutral values for the first.
    vectors = np.tile(NOMINAL.parameters, (2, 1))
    coefficients = np.array([NOMINAL.coefficients(), with_effects([effect]).coefficients()])
    both = ensemble.simulate(HEAVY.physics.converter, vectors, coefficients, FEW, SAMPLE_TIMES)
    says = f"{effect.name} is not exactly neutral at its neutral coefficients: write value + c * ... or the like"
    np.testing.assert_array_equal(both.shifting_time[0], baseline.shifting_time[0], says)
    np.testing.assert_array_equal(stacked(both)[0], stacked(baseline)[0], says)


@cache
def undisturbed(bench: Bench) -> tuple[Model, Conditions, np.ndarray]:
    """The model of a bench, its conditions in an order, and the signals without effects."""
    order = np.random.default_rng(4).permutation(len(bench.conditions))
    model, conditions = Model(bench.physics), replace(bench.conditions, run_order=order)
    return model, conditions, stacked(ensemble.signals(model, conditions, SAMPLE_TIMES))


@each_effect
@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_typical_coefficients_are_visible_and_every_engagement_locks(bench: Bench, effect: Effect) -> None:
    model, conditions, baseline = undisturbed(bench)
    its = effects.find(effect.name).on(bench.scales)
    response = ensemble.signals(with_effects([its], model=model), conditions, SAMPLE_TIMES)
    assert np.all(response.status == ensemble.LOCKED)
    rms = np.sqrt(np.mean((stacked(response) - baseline) ** 2, axis=(0, 1, 2)))
    difference = rms / np.ptp(baseline, axis=(0, 1, 2))
    assert difference[:4].max() > 2e-3, (
        f"{effect.name} changes no signal by more than 0.2 % of its range at its typical coefficients on the bench "
        f"{bench.name}: give larger typical values, or check their scale")


def test_typical_values_of_another_bench_would_be_noticed() -> None:
    model = with_effects([effect for effect in ON_HEAVY if effect.name == "quadratic_load_drag"],
                         model=Model(COMPACT.physics))
    assert not np.all(ensemble.signals(model, COMPACT.conditions, SAMPLE_TIMES).status == ensemble.LOCKED)


@each_effect
def test_the_response_to_small_amplitudes_is_continuous(effect: Effect) -> None:
    times = [ensemble.shifting_times(with_effects([effect], fraction), FEW, accuracy=ensemble.TIGHT)[0]
             for fraction in (0.0, 1e-3, 1.0)]
    assert np.abs(times[1] - times[0]).max() < 1e-2 * np.abs(times[2] - times[0]).max() + 1e-5


@each_effect
def test_only_effects_with_uses_run_order_depend_on_the_run_order(effect: Effect) -> None:
    reversed_order = replace(FEW, run_order=215 - np.asarray(FEW.run_order))
    forward, backward = (ensemble.shifting_times(with_effects([effect]), conditions)[0]
                         for conditions in (FEW, reversed_order))
    depends = not np.array_equal(forward, backward)
    assert depends == effect.uses_run_order, (
        f"{effect.name} {'depends' if depends else 'does not depend'} on the run order, and uses_run_order is "
        f"{effect.uses_run_order}: set it to {depends}")
    assert with_effects([effect]).uses_run_order == effect.uses_run_order
    assert not with_effects([effect], fraction=0.0).uses_run_order


def test_a_shape_coefficient_alone_does_not_make_an_effect_present() -> None:
    one = effects.find("stribeck_friction").on(HEAVY.scales)
    values = {c.name: c.typical if c.shape else c.neutral for c in one.coefficients}
    other = [2 * value if c.shape else value for c, value in zip(one.coefficients, values.values(), strict=True)]
    assert any(c.shape for c in one.coefficients)
    assert one.is_neutral(other)
    assert not one.is_neutral(one.typical)


def test_default_steps_are_short_enough_for_every_effect() -> None:
    for effect in ON_HEAVY:
        default, tight = (ensemble.shifting_times(with_effects([effect]), CONDITIONS, accuracy=accuracy)[0]
                          for accuracy in (ensemble.DEFAULT, ensemble.TIGHT))
        # A tenth of the assumed measurement noise of a shifting time; seal friction needs 3.6e-4.
        assert np.abs(default - tight).max() < (4e-4 if effect.name == "seal_friction" else 3e-4), effect.name


def test_a_lag_is_exact_for_signals_linear_between_samples() -> None:
    times = np.array([0.0, 0.004, 0.01, 0.011, 0.03, 0.06])
    values = np.array([[1.0, 3.0, -2.0, -2.0, 5.0, 5.0], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]])
    lags = np.array([[0.007], [0.0]])
    fine = np.linspace(0, 0.06, 600_001)
    linear, state, step = np.interp(fine, times, values[0]), values[0, 0], fine[1]
    expected = [state := state + step / lags[0, 0] * (0.5 * (before + after) - state)
                for before, after in pairwise(linear)]
    filtered = lagged_signal(values, times, lags)
    np.testing.assert_allclose(filtered[0, 1:], np.interp(times[1:], fine[1:], expected), atol=2e-5)
    np.testing.assert_array_equal(filtered[1], values[1])


@pytest.mark.parametrize("effect", [effect for effect in ON_HEAVY
                                    if effect.quantity not in SENSORS and effect.memory is None],
                         ids=lambda effect: effect.name)
def test_an_effect_depends_on_its_input_value(effect: Effect) -> None:
    signals = Signals(0.3, 4.0, 2.0, 1e-3, 120.0, 15.0, 70.0, 150.0, 0.6, 1.0, 0.1, 0.5, 0.3, 0.0, 100.0, 1e3, 2.0)
    # Otherwise it would discard the other effects on the same quantity.
    assert effect.formula(1.01, signals, effect.typical) != effect.formula(1.0, signals, effect.typical)


def test_sensor_effects_change_only_the_reading_of_their_sensor() -> None:
    model = NOMINAL.with_effect("pressure_sensor_gain", {"gain": 0.1}).with_effect("pressure_sensor_offset",
                                                                                 {"offset": 0.5})
    baseline, reading = (ensemble.signals(entry, CONDITIONS, SAMPLE_TIMES) for entry in (NOMINAL, model))
    # Catalogue order: lag, offset, gain.
    np.testing.assert_allclose(reading.pressure, (baseline.pressure + 0.5) * 1.1, rtol=1e-14)
    for name in SIGNALS[1:]:
        np.testing.assert_array_equal(getattr(reading, name), getattr(baseline, name))


def test_every_effect_is_described() -> None:
    assert len(effects.CATALOGUE) >= 30
    assert sorted(quantity for block in BLOCKS.values() for quantity in block) == sorted([*QUANTITIES, *SENSORS])
    for effect in effects.CATALOGUE:
        assert all((effect.title, effect.law, effect.source, effect.signature, effect.unit, effect.block))
        assert not all(c.shape for c in effect.coefficients)
        assert all(c.shape or c.typical != c.neutral for c in effect.coefficients), effect.name


def test_an_invalid_effect_is_rejected_with_its_name() -> None:
    effect = effects.find("thermal_fade")
    for changes, message in (({"quantity": "contact_pressure"}, "Did you mean 'contact pressure'"),
                             ({"coefficients": effect.coefficients * 5}, "no more"),
                             ({"coefficients": (replace(effect.coefficients[0], scale={"enery": -1}),)},
                              "Did you mean 'energy'"),
                             ({"coefficients": (replace(effect.coefficients[0], typical=1e9),)}, "within its bounds")):
        with pytest.raises((InvalidValue, UnknownName), match=message) as error:
            replace(effect, **changes).on(HEAVY.scales)
        assert "thermal_fade" in str(error.value)


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
@pytest.mark.parametrize("name", [effect.name for effect in effects.CATALOGUE])
def test_signals_are_finite_within_the_bounds_of_every_amplitude(bench: Bench, name: str) -> None:
    # Engagements may diverge at the bounds themselves, where a study reduces its step, but not inside them.
    model, effect, n = Model(bench.physics), effects.find(name).on(bench.scales), len(bench.conditions)
    few = replace(bench.conditions, run_order=np.random.default_rng(4).permutation(n)).take(
        np.linspace(0, n - 1, 4).astype(int))
    for amplitude in (c for c in effect.coefficients if not c.shape):
        for value in (amplitude.neutral + fraction * (bound - amplitude.neutral)
                      for bound in (amplitude.lower, amplitude.upper) for fraction in (0.25, 0.5, 0.75)):
            values = {c.name: c.typical if c.shape else c.neutral for c in effect.coefficients}
            values[amplitude.name] = value
            response = ensemble.signals(model.with_effect(effect.name, values), few, SAMPLE_TIMES)
            assert np.isfinite(stacked(response)).all(), (amplitude.name, value)


@each_effect
def test_every_amplitude_alone_has_an_effect(effect: Effect) -> None:
    baseline = stacked(ensemble.signals(NOMINAL, FEW, SAMPLE_TIMES))
    for amplitude in (c for c in effect.coefficients if not c.shape):
        values = {c.name: c.typical if c.shape or c is amplitude else c.neutral for c in effect.coefficients}
        changed = stacked(ensemble.signals(NOMINAL.with_effect(effect.name, values), FEW, SAMPLE_TIMES))
        assert np.abs(changed - baseline).max() > 0, f"{amplitude.name} is a shape coefficient: set shape=True"
