"""Laws of the engine as tables, and kinds as equations: each term is the column that the engine fits."""

import math
import re
from typing import Any, cast

import numpy as np
import pytest

from slipstick.engine.bases import Kind, flat_forms
from slipstick.engine.fit import Fit
from slipstick.engine.kinds import Coefficient, KindOfLaw
from slipstick.engine.measured_law import Law
from slipstick.errors import InvalidValue
from slipstick.law_files.machine_law import has_points, list_coefficients, tabulate, write_equation
from slipstick.machine.kinds import KINDS, TERMS
from slipstick.machine.kinds import Kind as Form

X = np.linspace(-1.2, 2.0, 9)
NO_FIT = cast(Fit, None)
"""Equations and tables do not read it."""
FUNCTIONS: dict[str, Any] = {"abs": abs, "min": min, "max": max, "exp": math.exp, "cos": math.cos, "sin": math.sin,
                             "pi": math.pi, "sign": np.sign}


def law_of(change: np.ndarray, pair: tuple[str, str] = ("pull", "rate"), kind: Kind = "own", unit: str = "N",
           known_up_to: int = 0, relative: bool = False) -> Law:
    return Law(pair, kind, unit, "m/s", X, change, 0.01 * np.eye(len(X)), known_up_to, period=0.002, relative=relative)


def form_of(name: str) -> Form:
    return next(form for form in KINDS if form.name == name)


def kind_of(form: Form, values: np.ndarray, shape: float) -> KindOfLaw:
    given = [*zip(form.coefficients, values, strict=True), *([(form.shape, shape)] if form.shape else [])]
    return KindOfLaw(("pull", "rate"), form.name, form,
                     tuple(Coefficient(name, float(value), 0.0, 1.0, "") for name, value in given), 20.0, NO_FIT)


@pytest.mark.parametrize("form", KINDS, ids=lambda form: form.name)
def test_the_equation_of_a_kind_evaluates_to_its_columns(form: Form) -> None:
    assert set(TERMS[form.name]) == set(form.coefficients)
    values, shape = np.array([0.5, -0.25, 2.0])[:len(form.coefficients)], 0.75
    law = law_of(np.zeros(len(X)), unit="")
    text = write_equation(law, kind_of(form, values, shape)).removeprefix("change of the pull = ")
    code = re.sub(r"\((-?[\d.]+) m/s\)", r"(\1)", text).replace("^", "**")
    expected = values @ np.stack(form.columns(X, shape))
    assert [eval(code, {"rate": at, **FUNCTIONS}) for at in X] == pytest.approx(expected)


@pytest.mark.parametrize("known_up_to", [0, 1, 2])
def test_a_table_has_the_band_and_the_change_by_the_kind(known_up_to: int) -> None:
    form = next(each for each in KINDS if each.name == "above a threshold")
    flat = flat_forms(len(X))[:, :known_up_to]
    change = 0.5 * np.maximum(X - 0.75, 0)
    change = change - flat @ (flat.T @ change / (flat**2).sum(axis=0))
    table = tabulate(law_of(change, known_up_to=known_up_to), kind_of(form, np.array([0.5]), 0.75))
    assert table.lower is not None
    assert table.upper is not None
    np.testing.assert_allclose(np.subtract(table.upper, table.lower), 2 * 1.96 * 0.1)
    assert table.formula == pytest.approx(change)
    assert (table.name, table.known_up_to) == ("pull_over_rate", ("nothing", "constant", "line")[known_up_to])
    assert table.equation is not None
    assert table.equation.startswith("change of the pull = 0.5 * max(0, rate - 0.75)")
    assert ("up to a" in table.equation) == (known_up_to > 0)


def test_equations_have_units_and_what_parameters_replace_is_said() -> None:
    coefficients = Coefficient("slope", -0.3, -0.4, -0.2, "1/(m/s)"), Coefficient("threshold", 1.1, 1.0, 1.2, "m/s")
    kind = KindOfLaw(("pull", "rate"), "above a threshold", form_of("above a threshold"), coefficients, 20.0, NO_FIT)
    assert write_equation(law_of(X, unit="", relative=True, known_up_to=1), kind) == (
        "relative change of the pull = (-0.3 1/(m/s)) * max(0, rate - (1.1 m/s)), up to a constant")
    curvature = Coefficient("curvature", 2e-6, 1e-6, 3e-6, "N/(m/s)^2")
    bent = KindOfLaw(("pull", "rate"), "quadratic", form_of("quadratic"), (curvature,), 20.0, NO_FIT)
    assert write_equation(law_of(X, known_up_to=2), bent) == (
        "change of the pull = (2e-06 N/(m/s)^2) * rate^2, up to a line")


@pytest.mark.parametrize(("pair", "basis", "name", "shape", "right"), [
    (("pull", "past voltage"), "past", "play", Coefficient("half width", 0.2, 0.1, 0.3, "V"),
     "((voltage after a play of half width 0.2 V) - voltage)"),
    (("rate sensor", "lag"), "lags", "first-order lag", Coefficient("time", 5.0, 4.0, 6.0, "samples"),
     "((rate after a first-order lag of 0.01 s) - rate)"),
    (("rate sensor", "lag"), "lags", "dead time", Coefficient("time", 5.0, 4.0, 6.0, "samples"),
     "((rate after a dead time of 0.01 s) - rate)")])
def test_memories_have_an_equation_and_no_table(pair: tuple[str, str], basis: Kind, name: str, shape: Coefficient,
                                                right: str) -> None:
    law = law_of(X, pair, basis)
    kind = KindOfLaw(pair, name, None, (Coefficient("share", 0.9, 0.8, 1.0, "1"), shape), 20.0, NO_FIT)
    assert write_equation(law, kind) == f"change of the {pair[0]} = 0.9 * {right}"
    _, known = list_coefficients(law, kind)
    assert (known.lower, known.unit) == ((pytest.approx(0.008), "s") if shape.unit == "samples" else (0.1, "V"))
    assert not has_points(law)
    with pytest.raises(InvalidValue, match=f"The {pair[1]} of the {pair[0]} has no points"):
        tabulate(law, kind)


def test_a_gain_and_a_curve_are_over_their_signals() -> None:
    assert tabulate(law_of(X, ("rate sensor", "gain"), "curve")).depends_on == "rate"
    assert tabulate(law_of(X, ("pull", "curve over rate"))).depends_on == "rate"
    single = Law(("pull", "offset"), "between", "N", "", np.zeros(1), np.ones(1), np.ones((1, 1)), 0)
    assert not has_points(single)
