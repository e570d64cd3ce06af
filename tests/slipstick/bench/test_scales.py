"""The scales of a bench, from their definitions and the numbers of the bench files."""

from dataclasses import astuple, fields, replace
from math import pi

import numpy as np
import pytest

from slipstick.bench import Bench, Physics, Scales, parameters
from slipstick.bench.scales import SCALES
from slipstick.errors import InvalidValue
from tests.benches import BENCHES, COMPACT, HEAVY


def changed(bench: Bench, name: str, value: float) -> Bench:
    nominal = list(bench.physics.nominal)
    nominal[parameters.index(name)] = value
    return replace(bench, physics=Physics(tuple(nominal), bench.physics.converter))


def test_the_scales_of_the_heavy_bench() -> None:
    pressure, speed = 20 * (0.8 - 0.1), 1900 * pi / 30
    torque = 0.00032e5 * pressure
    expected = Scales(pressure, 0.8, speed, speed / 3.2, torque, 3.2 * torque, 0.002, 0.0016 * pressure, 0.05,
                      0.5 * 14 * (speed / 3.2) ** 2 / 1000)
    np.testing.assert_allclose(astuple(HEAVY.scales), astuple(expected))


def test_the_scales_of_the_compact_bench() -> None:
    pressure, speed = 12 * (0.95 - 0.15), 3000 * pi / 30
    torque = 0.00017e5 * pressure
    expected = Scales(pressure, 0.95, speed, speed / 1.8, torque, 1.8 * torque, 0.0015, 0.0025 * pressure, 0.03,
                      0.5 * 0.9 * (speed / 1.8) ** 2 / 1000)
    np.testing.assert_allclose(astuple(COMPACT.scales), astuple(expected))


def test_every_scale_has_a_unit_and_words_and_is_positive() -> None:
    assert [*SCALES] == [field.name for field in fields(Scales)]
    assert all(unit and words for unit, words in SCALES.values())
    assert all(value > 0 for bench in BENCHES for value in astuple(bench.scales))


def test_the_piston_rate_is_that_of_the_piston_equation() -> None:
    assert changed(HEAVY, "piston_inertia", 2.0).scales.piston_rate == pytest.approx(HEAVY.scales.piston_rate / 2)


def test_an_input_shaft_without_converter_may_start_faster_than_the_motor() -> None:
    n = len(HEAVY.conditions)
    given = replace(HEAVY.conditions, input_torque=np.full(n, 100.0), initial_input_speed=np.full(n, 300.0))
    assert Scales.of(HEAVY.physics, given).speed == 300.0
    assert Scales.of(HEAVY.physics, replace(given, initial_input_speed=np.zeros(n))).speed == HEAVY.scales.speed


def test_profiles_below_the_bias_have_no_scales() -> None:
    with pytest.raises(InvalidValue, match=r"0\.8 A, gives no oil pressure: the current bias is 0\.9 A"):
        _ = changed(HEAVY, "current_bias", 0.9).scales
