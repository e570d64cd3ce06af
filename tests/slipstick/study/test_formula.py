"""The formula of an effect beside a measured law."""

import numpy as np
import pytest

from slipstick.naming.measured import LawPoints
from slipstick.study.formula import formula

X = np.linspace(0.0, 100.0, 6)


def law(pair: tuple[str, str], change: np.ndarray, relative: bool = False, up_to: str = "nothing") -> LawPoints:
    return LawPoints(pair, X, "rad/s", change, "N m", relative, np.eye(len(X)), up_to)  # type: ignore[arg-type]


def test_a_drag_is_the_square_of_the_speed() -> None:
    found = formula("quadratic_load_drag", [0.03], law(("load torque", "output speed"), 0.03 * X**2))
    np.testing.assert_allclose(found, 0.03 * X**2)  # type: ignore[arg-type]


def test_a_law_known_up_to_a_constant_is_compared_after_it_is_fitted() -> None:
    measured = law(("load torque", "output speed"), 0.03 * X**2 - 7, up_to="constant")
    found = formula("quadratic_load_drag", [0.03], measured)
    np.testing.assert_allclose(found, measured.change, atol=1e-12)  # type: ignore[arg-type]


def test_a_share_of_the_mean_is_compared_after_a_factor_is_fitted() -> None:
    exact = formula("stribeck_friction", [0.2, 20.0], law(("friction coefficient", "slip"), 0 * X, True))
    assert exact is not None
    measured = law(("friction coefficient", "slip"), (1 + exact) / 1.07 - 1, True, "constant")
    found = formula("stribeck_friction", [0.2, 20.0], measured)
    np.testing.assert_allclose(found, measured.change, atol=1e-12)  # type: ignore[arg-type]


def test_a_seal_friction_takes_the_drag_off_a_rate_in_both_directions() -> None:
    rates = np.array([-30.0, 0.0, 30.0])
    measured = LawPoints(("piston rate", "direction"), rates, "m/s", 0 * rates, "m/s", False, np.eye(3))
    np.testing.assert_allclose(formula("seal_friction", [0.01], measured), [0.01, 0.0, -0.01], rtol=1e-6)  # type: ignore[arg-type]


@pytest.mark.parametrize(("name", "pair"), [
    ("friction_buildup_lag", ("contact pressure", "lag")), ("entrained_air", ("piston rate", "pressure"))])
def test_memories_and_other_pairs_have_no_formula_over_the_points(name: str, pair: tuple[str, str]) -> None:
    assert formula(name, [0.1, 0.1], law(pair, X)) is None
