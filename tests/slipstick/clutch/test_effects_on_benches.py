"""Bounds and typical values of effects scale with the bench, and their units say with what."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.bench.scales import SCALES
from slipstick.clutch import effects
from slipstick.clutch.effects.effect import Coefficient, Effect
from slipstick.errors import InvalidValue
from slipstick.numerics.quantities import NotAQuantity, convert
from tests.benches import BENCHES, COMPACT, HEAVY

COEFFICIENTS = [(effect.name, c) for effect in effects.CATALOGUE for c in effect.coefficients]
each_coefficient = pytest.mark.parametrize(("effect", "c"), COEFFICIENTS,
                                           ids=[f"{effect}.{c.name}" for effect, c in COEFFICIENTS])


def has_the_unit_of_its_scales(c: Coefficient) -> bool:
    """Whether the product of the scales is in the unit of the coefficient: the same dimension, and a factor of 1."""
    written = "*".join(f"({SCALES[name][0]})^{power}" for name, power in c.scale.items())
    if not written or c.unit == "1":
        return not written and c.unit == "1"
    try:
        # A radian is no dimension: a twist is also a torque over a stiffness in N m.
        return bool(np.isclose(convert(np.array(1.0), written, c.unit.replace("rad", "1")), 1.0, rtol=1e-12))
    except NotAQuantity:
        return False


@each_coefficient
def test_every_effect_scales_with_its_unit(effect: str, c: Coefficient) -> None:
    assert has_the_unit_of_its_scales(c), f"{effect}.{c.name} is in {c.unit}, its scales are {dict(c.scale)}"


@pytest.mark.parametrize(("unit", "scale"), [
    ("N m s^2", {}), ("N m s^2", {"load_torque": 1, "load_speed": -1}), ("1/kJ", {"energy": 1}), ("m", {"time": 1}),
    ("1/J", {"energy": -1}), ("1", {"time": 1}), ("ms", {"time": 1}), ("Pa", {"pressure": 1})])
def test_a_missing_or_wrong_scale_would_be_found(unit: str, scale: dict[str, int]) -> None:
    assert not has_the_unit_of_its_scales(Coefficient("any", unit, 0.0, -1.0, 1.0, "", 0.5, scale=scale))


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
@each_coefficient
def test_the_bounds_on_a_shipped_bench_hold_the_typical_and_the_neutral_value(
        bench: Bench, effect: str, c: Coefficient) -> None:
    on = c.on(bench.scales)
    assert on.lower <= on.typical <= on.upper
    assert on.lower <= on.neutral <= on.upper
    assert on.neutral == c.neutral


def test_a_coefficient_on_a_bench_is_its_multiple_of_the_scales() -> None:
    drag = effects.find("quadratic_load_drag").coefficients[0]
    for bench in BENCHES:
        size = bench.scales.load_torque / bench.scales.load_speed**2
        on = drag.on(bench.scales)
        np.testing.assert_allclose([on.lower, on.upper, on.typical],
                                   [drag.lower * size, drag.upper * size, drag.typical * size])
        assert on.on(COMPACT.scales) == on  # absolute, so not scaled again
    strength = effects.find("stribeck_friction").coefficients[0]
    assert strength.on(HEAVY.scales) == strength.on(COMPACT.scales) == strength


def test_bounds_in_the_units_of_one_bench_would_be_out_of_scale_on_the_other() -> None:
    ratios = [c.on(COMPACT.scales).typical / c.on(HEAVY.scales).typical for _, c in COEFFICIENTS if c.scale]
    assert min(ratios) < 0.1
    assert max(ratios) > 2


def test_the_neutral_value_of_a_shape_may_be_out_of_bounds_on_an_unusual_bench_but_not_of_an_amplitude() -> None:
    slow = replace(HEAVY.scales, load_speed=1.0)
    effect = effects.find("falling_load_friction")
    excess, share, decay = effect.on(slow).coefficients
    assert decay.neutral > decay.upper
    shifted = replace(effect, coefficients=(replace(excess, neutral=100.0), share, decay))
    with pytest.raises(InvalidValue, match="excess of the effect falling_load_friction"):
        shifted.on(slow)


def test_a_coefficient_on_a_bench_keeps_its_place_in_the_coefficient_vector() -> None:
    def spans(of: tuple[Effect, ...]) -> list[slice]:
        return [effects.span(effect) for effect in of]
    assert spans(tuple(effect.on(COMPACT.scales) for effect in effects.CATALOGUE)) == spans(effects.CATALOGUE)
