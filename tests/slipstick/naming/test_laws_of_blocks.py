"""Values of laws with units have the effect that a block predicts from the coefficients: in the simulator, where it
has the law or an effect of this strength, or in the inputs of the block."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.clutch import effects
from slipstick.clutch.effects.effect import SCALAR_DEPENDENCES, Signals
from slipstick.clutch.lag import lagged_signal
from slipstick.clutch.model import Model
from slipstick.naming.block import Block, Pair
from slipstick.naming.law_map import UNITS, LawMap
from slipstick.naming.measured import LawPoints
from slipstick.naming.scene import OF_PLATES, Scene
from slipstick.naming.varying_lag import CONSTANT
from slipstick.recordings import Recordings
from tests.benches import BENCHES, HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of, with_plates

both = pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
NAMES = ("valve", "load", "input", "lock", "clutch", "contact")
each = pytest.mark.parametrize("name", NAMES)
COUNT = 8
ABSOLUTE = {"valve current": ("current", 0.012), "chamber pressure": ("pressure", 0.01), "piston rate": (
    "piston_rate", 0.04), "clearance": ("stroke", 0.025), "input torque": ("torque", 0.02),
    "load torque": ("load_torque", 0.02), "pressure sensor": ("pressure", 0.01), "input speed sensor": ("speed", 0.01),
    "output speed sensor": ("speed", 0.01), "output torque sensor": ("torque", 0.02)}
"""Sizes of laws: multiples of a scale of the bench, or relative."""
RELATIVE = {"film torque": 0.5, "brake torque": 0.5}
AMONG = {("valve current", "past current"): 1, ("converter torque", "lag"): 1, ("input speed sensor", "lag"): 1,
         ("output speed sensor", "lag"): 1, ("output torque sensor", "lag"): 1, ("pressure sensor", "lag"): 1}
"""Which of the lags or widths of a basis is the strength of the effect."""
EFFECTS = {("valve current", "past current"): "valve_hysteresis", ("converter torque", "lag"): "converter_lag",
           **{(f"{name} sensor", on): f"{name} sensor {on}".replace(" ", "_") for on in ("offset", "gain", "lag")
              for name in ("pressure", "input speed", "output speed", "output torque")
              if (name, on) != ("pressure", "gain")}}
"""Effects of the simulator whose one coefficient is the value of a law."""
DIRECT = {("valve delay", "motor speed"), ("valve delay", "run order"), ("output torque sensor", "pressure"),
          ("output torque sensor", "output speed"), ("pressure sensor", "input speed"), ("pressure sensor", "gain"),
          ("load torque", "output position"), ("brake torque", "output position"), ("stick torque", "twist"),
          ("contact pressure", "lag"),
          *((f"{name} sensor", on) for name in ("pressure", "input speed", "output speed", "output torque")
            for on in ("run order", "time"))}
"""Pairs with a test of their own."""
CLOSE = 0.06
LOOSE = {("converter torque", "lag"): 0.2, ("friction coefficient", "heat"): 0.1,
         ("friction coefficient", "time in contact"): 0.15, ("clearance", "pressure"): 0.07}
"""The block lags the torque at the speed without the lag, and estimates when friction begins to heat. The simulator
counts the ramp of the friction as time in contact in part. The constant up to which a clearance is known goes with an
initial position, in which the torque is not linear."""


def is_simulated(pair: Pair) -> bool:
    """Whether the simulator can have the law of a pair: it has no angles, laws of a delay, or sensors of the plates."""
    if pair[0] in {"valve delay", *CONSTANT}:
        return False
    over = {"output position"} | ({"slip", "current", *OF_PLATES} if pair[0].endswith("sensor") else set())
    return pair[1] not in over


def simulated_block(name: str, bench: Bench, model: Model) -> Block:
    """A block of recordings that know what the plates do."""
    return block_of(name, with_plates(scene_of(bench, model, COUNT)))


@cache
def nominal(bench: Bench, name: str) -> Block:
    return simulated_block(name, bench, Model(bench.physics))


def drawn(bench: Bench, pair: Pair, law: LawMap) -> np.ndarray:
    """Coefficients of a law of a plausible size."""
    scale, share = ("", RELATIVE.get(pair[0], 0.05)) if law.relative else ABSOLUTE[pair[0]]
    coefficients = np.cos(4 * np.arange(law.onto.shape[1]) / law.onto.shape[1])
    size = share * (getattr(bench.scales, scale) if scale else 1.0)
    return np.asarray(size / np.abs(law.onto @ coefficients).max() * coefficients)


def values(pair: Pair, law: LawMap, coefficients: np.ndarray) -> LawPoints:
    return LawPoints(pair, law.x, law.x_unit, law.onto @ coefficients, law.unit, law.relative,
                     np.zeros((len(law.onto), len(law.onto))), law.up_to)


def left(block: Block, pair: Pair, coefficients: np.ndarray) -> float:
    """What of the signal a prediction with a law leaves, as a share of what one without it leaves.

    A law known up to a constant goes with a common change of the parameters.
    """
    points = np.zeros((len(block.measured), len(block.random)))
    sizes = []
    for laws in ([(pair, coefficients)], []):
        predicted = block.base(points, laws)
        residual = (block.measured - predicted)[block.counted]
        if block.law(pair).up_to != "nothing":
            columns = np.concatenate(block.columns(points, laws, predicted), axis=1).transpose(0, 2, 1)[block.counted]
            columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
            residual = residual - columns @ np.linalg.lstsq(columns, residual)[0]
        sizes.append(float(np.linalg.norm(residual)))
    return sizes[0] / sizes[1]


@both
@each
def test_a_law_in_the_simulator_has_the_effect_of_its_coefficients(bench: Bench, name: str) -> None:
    found = {}
    for pair in nominal(bench, name).pairs(rare=True):
        if pair in {*EFFECTS, *DIRECT} or not is_simulated(pair):
            continue
        law = nominal(bench, name).law(pair)
        simulated = values(pair, law, drawn(bench, pair, law)).simulated()
        assert simulated is not None
        block = simulated_block(name, bench, Model(bench.physics).with_law(simulated))
        law = block.law(pair)  # the knots move with the signals
        assert law.x is not None
        change = np.interp(law.x, simulated.at, simulated.change)
        found[pair] = left(block, pair, np.linalg.lstsq(law.onto, change)[0])
    assert not {pair: share for pair, share in found.items() if share > LOOSE.get(pair, CLOSE)}


@both
@each
def test_an_effect_of_the_simulator_is_a_law_of_its_strength(bench: Bench, name: str) -> None:
    found = {}
    for pair in (pair for pair in nominal(bench, name).pairs(rare=True) if pair in EFFECTS):
        law = nominal(bench, name).law(pair)
        effect = effects.find(EFFECTS[pair]).on(bench.scales)
        strength = law.onto[0, AMONG[pair]] if pair in AMONG else effect.typical[0]
        coefficients = np.eye(law.onto.shape[1])[AMONG.get(pair, 0)]
        if pair not in AMONG:
            coefficients = np.linalg.lstsq(law.onto, np.full(len(law.onto), strength))[0]
        scene = scene_of(bench, Model(bench.physics).with_effect(effect.name, {effect.coefficients[0].name: strength}),
                         COUNT)
        found[pair] = left(block_of(name, scene), pair, coefficients)
    assert not {pair: share for pair, share in found.items() if share > LOOSE.get(pair, CLOSE)}


@both
def test_a_converter_lag_that_is_the_same_everywhere_is_that_of_the_simulator(bench: Bench) -> None:
    pair, lag = ("converter lag", "slip"), effects.find("converter_lag").on(bench.scales).typical[0]
    block = simulated_block("input", bench, Model(bench.physics).with_effect("converter_lag", {"lag": lag}))
    coefficients = np.linalg.lstsq(block.law(pair).onto, np.full(len(block.law(pair).onto), lag))[0]
    assert left(block, pair, coefficients) < LOOSE["converter torque", "lag"]
    assert left(block, pair, -coefficients) > 1


@pytest.mark.parametrize("on", ["time", "run order", "output position"])
def test_a_lag_of_the_friction_that_is_the_same_everywhere_is_a_first_order_one(on: str) -> None:
    block, pair, lag = nominal(HEAVY, "clutch"), ("friction lag", on), 0.04
    points = np.zeros((COUNT, len(block.random)))
    plain, onto = block.base(points), block.law(pair).onto
    found = block.base(points, [(pair, np.linalg.lstsq(onto, np.full(len(onto), lag))[0])])
    expected = lagged_signal(plain, block.scene.time, np.array([lag]))
    assert np.abs(expected - plain).max() > 0.05 * plain.max()
    seen = block.counted  # the last samples are those of the signal after it, which is 0 there
    np.testing.assert_allclose(found[seen], expected[seen], atol=0.002 * plain.max())


@both
def test_a_seal_friction_is_a_law_over_the_rate_that_the_pressure_gives(bench: Bench) -> None:
    effect, blank = effects.find("seal_friction").on(bench.scales), Signals(*[0.0] * len(Signals._fields))
    drag, pair = effect.typical[0], ("piston rate", "direction")
    block = simulated_block("clutch", bench, Model(bench.physics).with_effect(effect.name, {"drag": drag}))
    block.finer = {pair: 2}
    law = block.law(pair)
    assert law.x is not None
    change = [effect.formula(rate, blank, (drag,)) - rate for rate in law.x]
    assert left(block, pair, np.linalg.lstsq(law.onto, change)[0]) < 0.1


@each
def test_every_pair_has_units_and_one_of_these_tests(name: str) -> None:
    block = nominal(HEAVY, name)
    points = np.zeros((COUNT, len(block.random)))
    base = block.base(points)
    for pair in block.pairs(rare=True):
        law = block.law(pair)
        assert law.onto.shape[1] == block.basis(pair, points, (), base).shape[1], pair
        if law.x is None:
            assert (len(law.onto), law.relative) == (1, False)
            assert law.unit == {"lag": "s", "twist": "rad/(N m)"}.get(pair[1], UNITS[pair[0]])
        else:
            assert law.x.shape == law.onto.shape[:1]
            assert np.all(np.diff(law.x) > 0)
            assert law.unit == ("1" if law.relative else UNITS[pair[0]])
            known = {**SCALAR_DEPENDENCES, "output position": "rad", "direction": "m/s", "gain": UNITS[pair[0]]}
            assert law.x_unit == known[pair[1]]
        if pair not in {*DIRECT, *EFFECTS} and is_simulated(pair):
            assert values(pair, law, law.onto[0]).simulated() is not None


def test_a_relative_delay_of_the_valve_is_that_of_its_parameter() -> None:
    block, points = nominal(HEAVY, "valve"), np.zeros((COUNT, 3))
    for on in ("motor speed", "run order"):
        law = block.law(("valve delay", on))
        c = np.linspace(0.3, 1.2, law.onto.shape[1])  # up to more than twice the delay
        moved = points.copy()
        moved[:, 0] = np.interp(block.scene.constant_in_run(on), law.x, law.onto @ c)  # type: ignore[arg-type]
        assert np.ptp(moved[:, 0]) > 0.3
        assert np.abs(moved[:, 0].mean()) < 1e-12
        np.testing.assert_allclose(block.base(points, [(("valve delay", on), c)]), block.base(moved), atol=1e-12)


def test_a_delay_of_the_valve_within_an_engagement_is_a_share_of_it() -> None:
    block, points = nominal(HEAVY, "valve"), np.zeros((COUNT, 3))
    for on in ("time", "slip", "heat"):
        law = block.law(("valve delay", on))
        c = np.full(law.onto.shape[1], 0.7)
        moved = points.copy()
        moved[:, 0] = 0.7  # beyond the first knot it is a longer delay, and only there
        plain, slowed, found = block.base(points), block.base(moved), block.base(points, [(("valve delay", on), c)])
        x = block.scene.abscissa(on)
        assert law.x is not None
        if on == "slip":  # which begins far beyond the first knot, and comes back to it
            until = x.shape[1] - np.argmax((x >= law.x[1])[:, ::-1], axis=1)
            early = np.arange(x.shape[1]) < until[:, None]
            np.testing.assert_allclose(found[early], slowed[early], atol=0.02 * plain.max())
        else:
            assert np.abs(found - plain).max() > 0.1 * np.abs(slowed - plain).max()
            np.testing.assert_allclose(found[x == 0], plain[x == 0], atol=1e-9)


@pytest.mark.parametrize("on", ["run order", "output speed"])
def test_the_columns_of_a_valve_delay_are_its_derivatives(on: str) -> None:
    block, pair, h = nominal(HEAVY, "valve"), ("valve delay", on), 1e-4
    points = 0.1 * np.random.default_rng(8).standard_normal((COUNT, 3))
    c = np.linspace(0.2, 0.5, block.law(pair).onto.shape[1])
    base = block.base(points, [(pair, c)])
    columns = block.basis(pair, points, [(pair, c)], base)
    for k, one in enumerate(np.eye(len(c))):
        change = (block.base(points, [(pair, c + h * one)]) - block.base(points, [(pair, c - h * one)])) / (2 * h)
        np.testing.assert_allclose(columns[:, k], change, atol=2e-3 * np.abs(change).max())
    own = block.columns(points, [(pair, c)], base)[0]
    for k, one in enumerate(np.eye(3)):
        change = (block.base(points + h * one, [(pair, c)]) - block.base(points - h * one, [(pair, c)])) / (2 * h)
        np.testing.assert_allclose(own[:, k], change, atol=2e-3 * np.abs(change).max())


def with_reading(scene: Scene, signal: str, change: np.ndarray) -> Scene:
    """A scene in which the sensor of a signal reads `change` (n, k) more."""
    signals = replace(scene.signals, **{signal: scene.measured(signal) + change})
    recordings = scene.recordings
    return replace(scene, recordings=Recordings(recordings.conditions, recordings.measured_time, signals))


@pytest.mark.parametrize("on", ["run order", "time"])
@pytest.mark.parametrize(("name", "sensor"), [
    ("valve", "pressure"), *((name, "output torque") for name in ("load", "input", "clutch", "contact")),
    *((name, "output speed") for name in ("load", "lock")), *((name, "input speed") for name in ("input", "lock"))])
def test_a_drift_of_a_sensor_is_in_its_reading(name: str, sensor: str, on: str) -> None:
    block, pair = nominal(HEAVY, name), (f"{sensor} sensor", on)
    law, scene = block.law(pair), block.scene
    assert law.x is not None
    c = np.linspace(0.2, -0.1, law.onto.shape[1])
    drift = np.interp(scene.run[:, None] if on == "run order" else scene.time, law.x, law.onto @ c)
    drift = np.broadcast_to(drift, (len(scene), len(scene.time)))
    assert np.ptp(drift) > 0
    assert left(block_of(name, with_reading(scene, sensor.replace(" ", "_"), drift)), pair, c) < CLOSE


@pytest.mark.parametrize(("name", "sensor", "on"), [
    ("valve", "pressure", "input speed"), ("valve", "pressure", "gain"),
    *((name, "output torque", on) for name in ("load", "input", "clutch", "contact")
      for on in ("pressure", "output speed", "slip", "current", "heat", "piston position", "output position")),
    ("load", "output speed", "current"), ("input", "input speed", "current"), ("valve", "pressure", "time in contact")])
def test_an_error_of_a_sensor_over_a_signal_is_in_its_reading(name: str, sensor: str, on: str) -> None:
    block, pair = nominal(HEAVY, name), (f"{sensor} sensor", on)
    law = block.law(pair)
    c = np.linspace(0.2, -0.1, law.onto.shape[1])
    x = np.maximum(0, block.scene.abscissa(sensor if on == "gain" else on))
    error = np.interp(x, law.x, law.onto @ c) * (x if on == "gain" else 1)  # type: ignore[arg-type]
    assert left(block_of(name, with_reading(block.scene, sensor.replace(" ", "_"), error)), pair, c) < 0.05


@pytest.mark.parametrize("quantity", ["load torque", "brake torque"])
def test_a_torque_over_position_is_against_the_motion(quantity: str) -> None:
    block, pair = nominal(HEAVY, "load"), (quantity, "output position")
    law, brake = block.law(pair), block.scene.recordings.conditions.brake_torque
    assert np.ptp(brake) > 0
    c = np.cos(np.arange(law.onto.shape[1]))
    position = np.cumsum(np.maximum(block.scene.smooth["output_speed"], 0), axis=1) * block.scene.step
    change = np.interp(position, law.x, law.onto @ c) * (brake[:, None] if law.relative else 1)  # type: ignore[arg-type]
    # A load that reads too much torque for its speed has this much more resistance.
    assert left(block_of("load", with_reading(block.scene, "output_torque", change)), pair, c) < 0.05


def test_a_twist_is_the_compliance_on_the_input_side() -> None:
    compliance, pair = 2e-4, ("stick torque", "twist")
    model = Model(HEAVY.physics).with_effect("shaft_compliance", {"compliance": compliance, "damping": 0.01})
    block = block_of("lock", scene_of(HEAVY, model, COUNT))
    # The oscillation after lock-up is no part of the law.
    block.counted &= block.scene.time > block.scene.recordings.measured_time[:, None] + 0.1
    assert left(block, pair, compliance / block.law(pair).onto[0]) < 0.15


def test_a_contact_pressure_that_lags_does_so_as_the_torque_sensor() -> None:
    block = nominal(HEAVY, "contact")
    points = np.zeros((COUNT, 1))
    laws = [block.law((quantity, "lag")) for quantity in ("contact pressure", "output torque sensor")]
    columns = [block.basis((quantity, "lag"), points, (), block.base(points))
               for quantity in ("contact pressure", "output torque sensor")]
    np.testing.assert_array_equal(laws[0].onto, laws[1].onto)
    np.testing.assert_allclose(columns[0], columns[1])
