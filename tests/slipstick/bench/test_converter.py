"""The converter curves as the compiled simulator takes them: a line and hinges, at any points."""

import json

import numpy as np
import pytest
from scipy.optimize import brentq

from slipstick.bench import Conditions, Converter, Physics
from slipstick.bench.converter import MOST_POINTS, MOST_TERMS, NO_CONVERTER
from slipstick.clutch.ensemble import initial_input_speed
from slipstick.clutch.loading import torque as compiled_torque
from slipstick.errors import InvalidValue
from tests.benches import BENCHES, HEAVY

torque = compiled_torque.py_func  # it has no wrapper for calls from Python


def random_converter(rng: np.random.Generator, points: int) -> Converter:
    ratio = np.sort(rng.uniform(0, 1, points))
    ratio[[0, -1]] = 0.0, 1.0
    torque_ratio = np.sort(rng.uniform(0.9, 2.5, points))[::-1]
    return Converter(*(tuple(curve.tolist()) for curve in (ratio, torque_ratio, np.sort(rng.uniform(10, 90, points)))))


@pytest.mark.parametrize("points", [2, 3, 5, 6, 7, 13, 40, MOST_POINTS])
def test_the_terms_are_the_curves(points: int) -> None:
    rng = np.random.default_rng(points)
    for _ in range(20):
        converter = random_converter(rng, points)
        assert len(converter.terms) <= MOST_TERMS
        for ratio in (*rng.uniform(-0.2, 1.3, 20), *converter.speed_ratio):
            assert torque(converter.terms, ratio, 150.0) == pytest.approx(converter.torque(150.0 * ratio, 150.0),
                                                                         rel=1e-9)


@pytest.mark.parametrize("points", [2, 6, 13, MOST_POINTS])
def test_the_compiled_initial_speed_is_that_of_the_curves(points: int) -> None:
    rng, p = np.random.default_rng(points), dict(zip(("coulomb", "viscous"), (4.0, 0.02), strict=True))
    conditions = HEAVY.conditions
    vectors = np.array([HEAVY.physics.nominal])
    for _ in range(20):
        converter = random_converter(rng, points)
        speeds, column = initial_input_speed(converter, vectors, conditions)
        for row in (0, 100, 215):
            motor = float(conditions.motor_speed[row])
            net = lambda speed, m=motor, c=converter: c.torque(speed, m) - p["viscous"] * speed - p["coulomb"]  # noqa: E731
            balanced = brentq(net, 0.0, 2 * motor, xtol=1e-12) if net(2 * motor) < 0 < net(0) else None
            if balanced is None:  # a converter without balance runs up to the end of the search
                assert speeds[0, column[row]] in (pytest.approx(0.0, abs=1e-9), pytest.approx(2 * motor))
            else:
                assert speeds[0, column[row]] == pytest.approx(balanced, rel=1e-9)


def test_a_missing_hinge_would_be_seen() -> None:
    terms = HEAVY.physics.curves.terms.copy()
    terms[7 + 3 * 8 + 2] *= 1.001  # change of the slope of the capacity factor at the ninth hinge
    ratio = np.linspace(0, 1, 50)
    wrong = np.array([torque(terms, one, 150.0) for one in ratio])
    right = np.array([HEAVY.physics.curves.torque(150.0 * one, 150.0) for one in ratio])
    assert np.max(np.abs(wrong / right - 1)) > 1e-6


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_physics_survive_json(bench) -> None:
    restored = Physics.from_spec(json.loads(json.dumps(bench.physics.spec())))
    assert restored == bench.physics
    assert restored.digest == bench.digest
    without = Physics(bench.physics.nominal, None)
    assert Physics.from_spec(json.loads(json.dumps(without.spec()))) == without
    assert without.curves is NO_CONVERTER
    assert without.digest != bench.digest


@pytest.mark.parametrize(("curves", "message"), [
    (((0, 1), (2, 1), (10, 20, 30)), "have 2, 2 and 3 points"), (((0,), (2,), (10,)), "have 1, 1 and 1 points"),
    (((0, 0), (2, 1), (10, 20)), "do not rise"), (((1, 0), (2, 1), (10, 20)), "do not rise"),
    (((0, np.nan), (2, 1), (10, 20)), "is not finite"), (((0, 1), (2, -1), (10, 20)), "torque ratio is negative"),
    (((0, 1), (2, 1), (0, 20)), "capacity factor is not positive"),
    ((tuple(range(201)), (1.0,) * 201, (20.0,) * 201), "Give 2 to 200"),
])
def test_impossible_curves_are_refused(curves: tuple[tuple[float, ...], ...], message: str) -> None:
    with pytest.raises(InvalidValue, match=message):
        Converter(*curves)


def test_without_a_converter_the_input_speed_is_given() -> None:
    c = HEAVY.conditions.take([0, 1, 2])
    given = Conditions(c.current_profile, c.motor_speed, c.load_inertia, c.brake_torque, c.profile_time,
                       c.profile_current, input_torque=np.full(3, 80.0), initial_input_speed=np.array([0.0, 90.0, 0.0]))
    speeds, column = initial_input_speed(NO_CONVERTER, np.array([HEAVY.physics.nominal] * 2), given)
    np.testing.assert_array_equal(speeds[:, column], [[0, 90, 0], [0, 90, 0]])
    with pytest.raises(InvalidValue, match="do not come together"):
        Conditions(c.current_profile, c.motor_speed, c.load_inertia, c.brake_torque, c.profile_time, c.profile_current,
                   input_torque=np.full(3, 80.0))
