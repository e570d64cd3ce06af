"""Laws measured in noisy recordings of engagements that scatter: against the truth, and in the simulator."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipstick.bench import parameters
from slipstick.clutch import ensemble
from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.naming import answer
from slipstick.naming.block import Pair
from slipstick.naming.contact import ContactBlock, OnsetBlock
from slipstick.naming.fit import BlockFit, fit, fit_together
from slipstick.naming.measured import LawPoints, law_points, measure_laws
from slipstick.naming.parameters import converter_of, parameters_of
from slipstick.naming.selection import Finding
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

COUNT, SEED = 24, 3
NOMINAL = Model(HEAVY.physics)
DROOP, DRAG, STRENGTH, DECAY, HEAD, WAVE = 0.03, 0.02, 0.1, 25.0, 1e-5, 10.0
INSTANTS = np.linspace(0, 1.698, 9)  # where the law has its knots
IN_CONTACT = "friction coefficient", "time in contact"
WAVES = MeasuredLaw("converter torque", "time", tuple(INSTANTS), tuple(WAVE * np.sin(4 * INSTANTS)), False)
MODELS: dict[Pair, tuple[str, Model]] = {
    ("line pressure", "motor speed"): ("valve", NOMINAL.with_effect("supply_droop", {"droop": DROOP})),
    ("load torque", "output speed"): ("load", NOMINAL.with_effect("quadratic_load_drag", {"drag": DRAG})),
    ("friction coefficient", "slip"): ("contact", NOMINAL.with_effect(
        "stribeck_friction", {"strength": STRENGTH, "decay_speed": DECAY})),
    ("chamber pressure", "input speed"): ("contact", NOMINAL.with_effect("centrifugal_pressure", {"head": HEAD})),
    ("input torque", "time"): ("input", NOMINAL.with_law(WAVES)),
    ("valve current", "current"): ("valve", NOMINAL.with_effect(
        "valve_deadband", {"width": 0.01, "centre": 0.4, "rounding": 0.05}))}
LAWS: dict[Pair, tuple[Callable[[np.ndarray], np.ndarray], float]] = {
    ("line pressure", "motor speed"): (lambda x: -DROOP * (200 / x - 1), 0.003),
    ("load torque", "output speed"): (lambda x: DRAG * x**2, 2.0),
    ("friction coefficient", "slip"): (lambda x: STRENGTH * np.exp(-x / DECAY), 0.004),
    ("chamber pressure", "input speed"): (lambda x: HEAD * x**2, 0.033),
    ("input torque", "time"): (lambda x: np.interp(x, WAVES.at, WAVES.change), 0.6)}
"""The true law, and how far knots may be from it: in the unit of the change."""
NAMED = {("line pressure", "motor speed"): "supply_droop", ("load torque", "output speed"): "quadratic_load_drag",
         ("friction coefficient", "slip"): "stribeck_friction",
         ("chamber pressure", "input speed"): "centrifugal_pressure", ("valve current", "current"): "valve_deadband"}


@cache
def fitted(pair: Pair) -> tuple[BlockFit, BlockFit]:
    """The fits of a block without the law of a pair and with it."""
    name, model = MODELS[pair]
    block = block_of(name, scene_of(HEAVY, model, COUNT, SEED))
    return fit(block), fit(block, (pair,))


def without_constant(law: LawPoints, true: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Errors (m,) of a law and their standard errors, without the constant up to which it is known."""
    weight = 1 / law.std**2
    centre = np.eye(len(true)) - weight / weight.sum() if law.up_to != "nothing" else np.eye(len(true))
    return centre @ (law.change - true), np.sqrt(np.diag(centre @ law.covariance @ centre.T))


@pytest.mark.parametrize("pair", LAWS, ids=" ~ ".join)
def test_a_measured_law_is_the_true_one_within_its_errors(pair: Pair) -> None:
    law = law_points(fitted(pair)[1], pair)
    true, close = LAWS[pair]
    assert law.x is not None
    error, std = without_constant(law, true(law.x))
    assert np.all(np.abs(error) < 4 * std)
    well = law.std < 3 * np.median(law.std)
    assert np.abs(error[well]).max() < close < 0.5 * np.ptp(true(law.x))


def test_the_time_in_contact_is_that_of_the_simulator_however_fast_the_plates_close() -> None:
    law, pair = MeasuredLaw("friction coefficient", "time in contact", (0.0, 0.3), (-0.3, 0.0), True), IN_CONTACT
    block = block_of("contact", scene_of(HEAVY, NOMINAL.with_law(law), COUNT))
    assert isinstance(block, ContactBlock)
    right = fit(block, (pair,))
    assert right.points.std() < 1e-6  # no engagement differs from the others
    block.in_contact = replace(block.in_contact, time=block.in_contact.full)
    assert fit(block, (pair,)).points.std() > 1e-4


@pytest.mark.parametrize("pair", NAMED, ids=" ~ ".join)
def test_a_measured_law_has_the_shape_of_its_effect(pair: Pair) -> None:
    law = law_points(fitted(pair)[1], pair)
    finding = Finding((), pair, np.ones(COUNT))
    found = answer(finding, law)
    assert NAMED[pair] in (found.effect, *found.others)


@pytest.mark.parametrize("pair", MODELS, ids=" ~ ".join)
def test_the_model_with_a_measured_law_has_the_signals_of_the_true_one(pair: Pair) -> None:
    model, signal = MODELS[pair][1], fitted(pair)[0].block.signal
    scene = fitted(pair)[0].block.scene

    def simulated(model: Model) -> np.ndarray:
        response = ensemble.signals(model, scene.recordings.conditions, scene.time)
        return np.asarray(getattr(response, signal)[0])

    def calibrated(one: BlockFit) -> Model:
        means = dict(zip(one.block.random, 1 + one.points.mean(axis=0), strict=True))
        return NOMINAL.with_parameters({name: factor * NOMINAL.parameters[parameters.index(name)]
                                        for name, factor in means.items() if name in parameters.NAMES})

    plain, with_law = fitted(pair)
    law = law_points(with_law, pair).simulated()
    assert law is not None
    true = simulated(model)
    without, there = (np.sqrt(np.mean((simulated(one) - true) ** 2))
                      for one in (calibrated(plain), calibrated(with_law).with_law(law)))
    assert there < 0.3 * without


@pytest.mark.parametrize(("name", "pair", "effect", "value", "close"), [
    ("load", ("output torque sensor", "offset"), "output_torque_sensor_offset", {"offset": 12.0}, 2.0),
    ("valve", ("valve current", "past current"), "valve_hysteresis", {"width": 0.012}, 4e-4),
    ("input", ("input speed sensor", "offset"), "input_speed_sensor_offset", {"offset": 0.8}, 0.2)])
def test_a_measured_number_is_the_true_one_within_its_error(
        name: str, pair: Pair, effect: str, value: dict[str, float], close: float) -> None:
    block = block_of(name, scene_of(HEAVY, NOMINAL.with_effect(effect, value), COUNT, SEED))
    law = law_points(fit(block, (pair,)), pair)
    assert abs(law.change[0] - sum(value.values())) < min(4 * law.std[0], close)


def test_a_gain_error_of_the_torque_sensor_is_measured_beside_parameters_that_have_taken_it() -> None:
    """Inertias, brake and converter that were fitted to the torque as it was read give a torque after lock-up that has
    the error as well: taken for a true one, it left half of the gain to them.
    """
    pair = ("output torque sensor", "gain")
    scene = scene_of(HEAVY, NOMINAL.with_effect("output_torque_sensor_gain", {"gain": 0.1}), COUNT, SEED)
    read = 1.1 * scene.smooth["output_torque"]
    scene = scene.explained("output_torque", scene.model_torque(read))
    fits = {name: fit(block_of(name, scene)) for name in ("load", "input")}
    torque = scene.model_torque(read, parameters_of(fits), converter_of(fits, HEAVY.physics.curves))
    starts = [fit(block_of(name, scene.explained("output_torque", torque))) for name in fits]
    found, _ = fit_together([start.block for start in starts], [(pair,)] * 2, starts)
    assert found.coefficients[pair][0] == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize(("name", "pair", "effect"), [
    ("load", ("output speed sensor", "lag"), "output_speed_sensor_lag"),
    ("load", ("output torque sensor", "lag"), "output_torque_sensor_lag"),
    ("valve", ("pressure sensor", "lag"), "pressure_sensor_lag"),
    ("input", ("converter torque", "lag"), "converter_lag")])
@pytest.mark.parametrize("lag", [0.008, 0.027])
def test_a_lag_between_those_of_the_mixture_is_measured_to_a_sixth(
        name: str, pair: Pair, effect: str, lag: float) -> None:
    block = block_of(name, scene_of(HEAVY, NOMINAL.with_effect(effect, {"lag": lag}), COUNT, SEED))
    law = measure_laws({name: fit(block, (pair,))})[pair]
    assert abs(law.change[0] - lag) < min(4 * law.std[0], lag / 6)


def test_a_wide_hysteresis_between_the_play_operators_is_measured_to_a_25th() -> None:
    width, pair = 0.09, ("valve current", "past current")
    block = block_of("valve", scene_of(HEAVY, NOMINAL.with_effect("valve_hysteresis", {"width": width}), COUNT, SEED))
    assert law_points(fit(block, (pair,)), pair).change[0] == pytest.approx(width, rel=1 / 25)


def test_a_gain_error_is_the_relative_error_over_the_signal() -> None:
    gain, pair = 0.02, ("input speed sensor", "gain")
    model = NOMINAL.with_effect("input_speed_sensor_gain", {"gain": gain})
    law = law_points(fit(block_of("lock", scene_of(HEAVY, model, COUNT, SEED)), (pair,)), pair)
    assert (law.relative, law.x_unit) == (True, "rad/s")
    assert np.all(np.abs(law.change - gain) < 4 * law.std)
    assert np.all(law.std < 0.01 * gain)


def test_an_elastic_shaft_is_measured_although_the_torque_of_rigid_ones_does_not_oscillate() -> None:
    compliance, pair = 8e-4, ("stick torque", "twist")
    model = NOMINAL.with_effect("shaft_compliance", {"compliance": compliance, "damping": 0.002})
    scene = scene_of(HEAVY, model, COUNT, SEED)
    scene = scene.explained("output_torque", scene.model_torque(scene.smooth["output_torque"]))
    plain = fit(block_of("lock", scene))
    found = fit(plain.block, (pair,), start=plain)
    assert plain.chi2.mean() > 2
    assert found.chi2.mean() - 1 < 0.2 * (plain.chi2.mean() - 1)
    assert law_points(found, pair).change[0] == pytest.approx(compliance, rel=0.2)


@pytest.mark.parametrize("offset", [0.0, 80.0])
def test_the_onset_of_the_torque_is_found_with_an_offset_of_its_sensor(offset: float) -> None:
    model = NOMINAL.with_effect("output_torque_sensor_offset", {"offset": offset}) if offset else NOMINAL
    scene = scene_of(HEAVY, model, COUNT, SEED)
    pressure = scene.smooth["pressure"]
    block, right = (OnsetBlock(one, pressure) for one in (scene, scene_of(HEAVY, NOMINAL, COUNT, SEED)))
    assert np.abs(block.counted.sum(axis=1) - right.counted.sum(axis=1)).max() <= 1
    np.testing.assert_allclose(block.measured, right.measured, atol=1.0)
    named = OnsetBlock(scene, pressure, laws=[(("output torque sensor", "offset"), np.array([offset]))])
    np.testing.assert_allclose(named.measured, scene.measured("output_torque"), atol=1.0)


def test_the_onset_is_found_in_signals_that_begin_after_the_command() -> None:
    right = scene_of(HEAVY, NOMINAL, COUNT, SEED)
    signals = right.recordings.signals
    assert signals is not None
    signals = replace(signals, time=signals.time[25:], **{name: signals[name][:, 25:] for name in signals.names})
    late = replace(right, recordings=replace(right.recordings, signals=signals),
                   smooth={name: values[:, 25:] for name, values in right.smooth.items()})
    block, known = (OnsetBlock(one, one.smooth["pressure"]) for one in (late, right))
    assert np.all(np.isfinite(block.measured))
    assert np.abs(block.end + 25 - known.end).max() <= 1


@pytest.mark.parametrize("drift", [0.0, 60.0])
def test_the_onset_is_found_where_the_zero_of_the_torque_sensor_drifts(drift: float) -> None:
    scene, right = (scene_of(HEAVY, NOMINAL, COUNT, SEED) for _ in range(2))
    signals, off = scene.recordings.signals, drift * scene.run[:, None] / scene.run.max()
    assert signals is not None
    signals = replace(signals, output_torque=signals.output_torque + off)
    scene = replace(scene, recordings=replace(scene.recordings, signals=signals))
    pressure = scene.smooth["pressure"]
    block, known = (OnsetBlock(one, pressure) for one in (scene, right))
    assert np.abs(block.counted.sum(axis=1) - known.counted.sum(axis=1)).max() <= 1
    noise = HEAVY.sensors["output_torque"].noise
    np.testing.assert_allclose(block.measured, known.measured, atol=2 * noise if drift else 0.0)
