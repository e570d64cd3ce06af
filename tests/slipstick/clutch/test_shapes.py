"""Pairs and shapes of effects: each formula has its own shape, and the test keeps its level and has power."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.clutch import effects
from slipstick.clutch.effects.effect import DEPENDENCES, SCALAR_DEPENDENCES, SENSORS, Effect, Signals
from slipstick.clutch.effects.shape import Shape
from slipstick.errors import InvalidValue, UnknownName
from tests.benches import BENCHES, HEAVY

LEVEL = 0.05
SCALAR = tuple(effect for effect in effects.CATALOGUE if effect.depends_on in SCALAR_DEPENDENCES)
RISING, FALLING = Shape("rises", "convex"), Shape("falls", "convex")
SIGNAL = {"motor speed": "motor_speed", "input speed": "input_speed", "output speed": "output_speed",
          "slip": "plate_slip", "pressure": "pressure", "current": "current", "time": "time", "heat": "memory",
          "time in contact": "memory", "piston position": "piston_state"}


def visited(bench: Bench, depends_on: str, points: int = 9) -> np.ndarray:
    """What a quantity depends on, over the range of a bench."""
    scales = bench.scales
    largest = {"motor speed": scales.speed, "input speed": scales.speed, "slip": scales.speed,
               "output speed": scales.load_speed, "pressure": scales.pressure, "current": scales.current, "time": 2.0,
               "time in contact": 1.0, "run order": float(len(bench.conditions)), "heat": scales.energy,
               "piston position": scales.stroke, "piston rate": scales.piston_rate}[depends_on]
    least = float(bench.conditions.motor_speed.min()) if depends_on == "motor speed" else 0.0
    return np.linspace(least, largest, points)


def change(effect: Effect, bench: Bench, x: np.ndarray) -> np.ndarray:
    """The change by the formula at the typical coefficients, where the quantity is 1 or the dependence itself."""
    base = dict.fromkeys(Signals._fields, 0.0)
    coefficients = effect.on(bench.scales).typical
    if effect.quantity in SENSORS:
        return np.asarray(effect.formula(np.ones_like(x), x, coefficients) - 1)
    changes = []
    for one in x:
        value = one if effect.depends_on == "piston rate" else 1.0
        name = SIGNAL.get(effect.depends_on)
        signals = Signals(**{**base, "run": one / 100, **({name: one} if name else {})})
        changes.append(effect.formula(value, signals, coefficients) - value)
    return np.array(changes)


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
@pytest.mark.parametrize("effect", SCALAR, ids=lambda effect: effect.name)
def test_the_formula_of_an_effect_has_its_shape(effect: Effect, bench: Bench) -> None:
    x = visited(bench, effect.depends_on)
    law = change(effect, bench, x)
    assert np.ptp(law) > 0, f"{effect.name} does not depend on the {effect.depends_on}"
    assert effect.shape is not None, f"{effect.name} has no shape over the {effect.depends_on}: give one"
    assert effect.shape.is_met(x, law), (
        f"The change of {effect.name} over the {effect.depends_on} does not have its {effect.shape} at typical "
        f"coefficients, but goes {law}: give the shape that it has, or Shape()")
    assert effect.shape.is_met(x, law, np.diag(np.full(len(x), (0.1 * np.ptp(law)) ** 2)))


def test_load_effects_do_not_have_the_shapes_of_each_other() -> None:
    x = visited(HEAVY, "output speed")
    for name, other in (("quadratic_load_drag", FALLING), ("falling_load_friction", RISING)):
        law = change(effects.find(name), HEAVY, x)
        error = np.diag(np.full(len(x), (0.1 * np.ptp(law)) ** 2))
        assert not other.is_met(x, law)
        assert not other.is_met(x, law, error)
        assert not other.is_met(x, law + 1e6, error), "a shape is tested up to a constant"


def drawn(law: np.ndarray, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Laws measured with correlated errors of a fifth of the range, (count, k), and their covariance (k, k)."""
    k = len(law)
    size = 0.2 * (np.ptp(law) or 1.0)
    covariance = size**2 * 0.5 ** np.abs(np.subtract.outer(np.arange(k), np.arange(k)))
    return np.random.default_rng(seed).multivariate_normal(law, covariance, count), covariance


@pytest.mark.parametrize("shape", [Shape(direction, curvature) for direction in ("rises", "falls", "either", "any")
                                   for curvature in ("convex", "concave", "any")] + [Shape("either", near_zero=True)],
                         ids=lambda shape: shape.words)
@pytest.mark.parametrize("law", ["a constant", "curved"])
def test_a_law_with_the_shape_is_rejected_at_most_with_the_level(shape: Shape, law: str) -> None:
    x, count = np.array([0.0, 1.0, 2.0, 4.0, 6.0, 7.0]), 800
    bent = -1 if shape.curvature == "concave" else 1
    rising = (shape.direction == "rises") == (bent > 0)
    true = 0 * x if law == "a constant" else bent * (x**2 if rising else (7 - x) ** 2)
    assert shape.is_met(x, true)
    laws, covariance = drawn(true, count, seed=1)
    rejected = sum(not shape.is_met(x, one, covariance, LEVEL) for one in laws)
    assert rejected <= count * LEVEL + 3 * np.sqrt(count * LEVEL)


@pytest.mark.parametrize(("shape", "law"), [
    (Shape("rises"), lambda x: -x), (Shape("falls"), lambda x: x), (Shape("either"), lambda x: np.abs(x - 3.5)),
    (RISING, lambda x: -((7 - x) ** 2)), (FALLING, lambda x: -(x**2)), (Shape("any", "convex"), lambda x: -(x**2)),
    (Shape("any", "either"), lambda x: np.sin(2 * np.pi * x / 7)),
    (Shape("either", near_zero=True), lambda x: np.maximum(x - 4, 0)),
])
def test_a_law_with_another_shape_is_rejected(shape: Shape, law) -> None:
    x = np.linspace(0, 7, 8)
    size = 0.05 * np.ptp(law(x))
    covariance = np.diag(np.full(8, size**2))
    laws = np.random.default_rng(2).multivariate_normal(law(x), covariance, 200)
    assert not shape.is_met(x, law(x))
    assert sum(shape.is_met(x, one, covariance, LEVEL) for one in laws) < 10


def test_a_law_with_fewer_degrees_of_freedom_than_points_is_tested() -> None:
    x = np.linspace(0, 1, 12)
    steep = np.array([[1.0, 0.3], [0.3, 1.0]]) * 0.01
    span = np.stack([np.ones(12), x], axis=1)
    covariance = span @ steep @ span.T
    assert Shape("rises", "convex").is_met(x, span @ [0.0, -0.1], covariance)
    assert not Shape("rises", "convex").is_met(x, span @ [0.0, -1.0], covariance)


def test_pairs_of_unknown_words_are_refused() -> None:
    effect = effects.find("stribeck_friction")
    with pytest.raises(UnknownName, match="Did you mean 'load torque'"):
        effects.matching("load torqe", "output speed")
    with pytest.raises(UnknownName, match="Did you mean 'output speed'"):
        effects.matching("load torque", "output sped")
    with pytest.raises(UnknownName, match=r"stribeck_friction.*Did you mean 'slip'"):
        replace(effect, depends_on="slipp")
    with pytest.raises(UnknownName, match=r"stribeck_friction.*Did you mean 'heat'"):
        replace(effect, also=(("friction coefficient", "heatt"),))
    with pytest.raises(InvalidValue, match="Leave out the shape"):
        replace(effect, depends_on="past current")
    with pytest.raises(UnknownName, match="Did you mean 'rises'"):
        Shape("rise")  # type: ignore[arg-type]
    with pytest.raises(InvalidValue, match="Give the direction"):
        Shape(near_zero=True)


@pytest.mark.parametrize(("x", "change", "covariance", "level", "message"), [
    ([0, 1], [0, 1, 2], None, LEVEL, "at least two points"), ([0], [0], None, LEVEL, "at least two points"),
    ([0, 0], [0, 1], None, LEVEL, "Sort the points"), ([0, 1], [0, np.nan], None, LEVEL, "leave out"),
    ([0, 1], [0, 1], np.eye(3), LEVEL, "at least two points"), ([0, 1], [0, 1], np.ones((2, 2)), LEVEL, "exact law"),
    ([0, 1], [0, 1], np.eye(2), 5.0, "between 0 and 1"),
])
def test_what_is_no_law_is_refused(x, change, covariance, level, message) -> None:
    with pytest.raises(InvalidValue, match=message):
        RISING.is_met(np.array(x, float), np.array(change, float), covariance, level)


def test_matching_finds_the_effects_of_a_pair() -> None:
    names = {pair: {effect.name for effect in effects.matching(*pair)} for pair in (
        ("load torque", "output speed"), ("piston rate", "pressure"), ("friction coefficient", "lag"),
        ("output torque sensor", "gain"), ("load torque", "time"))}
    assert names == {
        ("load torque", "output speed"): {"quadratic_load_drag", "falling_load_friction"},
        ("piston rate", "pressure"): {"entrained_air"}, ("friction coefficient", "lag"): {"friction_buildup_lag"},
        ("output torque sensor", "gain"): {"output_torque_sensor_gain"},
        ("load torque", "time"): set()}


@pytest.mark.parametrize("effect", effects.CATALOGUE, ids=lambda effect: effect.name)
def test_an_effect_is_found_under_each_of_its_pairs(effect: Effect) -> None:
    for pair in effect.pairs:
        assert effect in effects.matching(*pair)


def test_every_dependence_is_of_one_kind_and_every_shape_has_words() -> None:
    assert set(SCALAR_DEPENDENCES) < set(DEPENDENCES)
    words = {effect.shape.words for effect in effects.CATALOGUE if effect.shape}
    assert {"rises and flattens", "falls ever more steeply", "rises or falls throughout, most of it near zero"} <= words
