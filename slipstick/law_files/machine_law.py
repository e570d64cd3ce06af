"""Laws that the engine measured, as tables, and the equations of their kinds."""

import re
from dataclasses import replace
from typing import Literal

import numpy as np

from slipstick.engine.bases import flat_forms
from slipstick.engine.kinds import Coefficient, KindOfLaw
from slipstick.engine.laws import CURVE, GAIN, PAST
from slipstick.engine.measured_law import DEVIATIONS, Law
from slipstick.errors import InvalidValue
from slipstick.law_files.equation import describe_value
from slipstick.law_files.table import LawTable
from slipstick.machine.declaration import SENSOR
from slipstick.machine.kinds import MEMORIES, TERMS

_KNOWN_UP_TO: tuple[Literal["nothing", "constant", "line"], ...] = ("nothing", "constant", "line")


def has_points(law: Law) -> bool:
    """Whether a law is one over points, and neither a single number nor the weights of a memory."""
    return law.kind not in ("past", "lags") and len(law.x) > 1


def tabulate(law: Law, kind: KindOfLaw | None = None) -> LawTable:
    """Return a law as a table with its 95 % band, and the change by its `kind` if there is one.

    Raises `InvalidValue` for a law that has no points (`has_points`).
    """
    if not has_points(law):
        raise InvalidValue(f"The {law.pair[1]} of the {law.pair[0]} has no points",
                           "Read its coefficients from its kind, or its weights from `change`")
    margin = DEVIATIONS * law.std
    lower, upper = law.change - margin, law.change + margin
    return LawTable(law.pair[0], _name_variable(law), law.x.tolist(), law.on_unit, law.change.tolist(), law.unit,
                    law.relative, lower.tolist(), upper.tolist(), "95 % interval at each point",
                    None if kind is None else _evaluate(law, kind).tolist(),
                    None if kind is None else write_equation(law, kind), _KNOWN_UP_TO[law.known_up_to])


def write_equation(law: Law, kind: KindOfLaw) -> str | None:
    """Return the equation of the kind of a law, with its coefficients in numbers and their units.

    Such as `change of the left leak = (0.3 1/s) * max(0, left level - (1.1 m))`. It is None for a machine's own kind,
    whose form is a function.
    """
    if kind.name not in TERMS:
        return None
    terms, values = TERMS[kind.name], {each.name: describe_value(each.value, each.unit)
                                       for each in list_coefficients(law, kind)}
    shape = next((value for name, value in values.items() if name not in terms), "")
    if kind.name in MEMORIES:
        shape = shape.strip("()")  # it stands in words there
    names = {"x": _name_variable(law), "B": describe_value(float(law.x[0]), law.on_unit), "S": shape}
    parts = [values[name] + (" * " + re.sub(r"\b[xBS]\b", lambda word: names[word[0]], term)) * (term != "1")
             for name, term in terms.items() if name in values]
    left = f"{'relative ' * law.relative}change of the {law.pair[0]}"
    return f"{left} = {' + '.join(parts)}" + f", up to a {_KNOWN_UP_TO[law.known_up_to]}" * (law.known_up_to > 0)


def list_coefficients(law: Law, kind: KindOfLaw) -> list[Coefficient]:
    """Return the coefficients of the kind of a law, with times in s rather than in samples."""
    return [each if each.unit != "samples" else
            replace(each, value=each.value * law.period, lower=each.lower * law.period,
                    upper=each.upper * law.period, unit="s") for each in kind.coefficients]


def _name_variable(law: Law) -> str:
    """Return what a law is over: of the past and the errors of a sensor, the signal."""
    quantity, on = law.pair
    if law.kind == "lags" or on == GAIN:
        return quantity.removesuffix(SENSOR)
    return on.removeprefix(CURVE).removeprefix(PAST)


def _evaluate(law: Law, kind: KindOfLaw) -> np.ndarray:
    """Return the changes (m,) by a kind, without the flat forms that parameters replace."""
    form, values = kind.kind, {each.name: each.value for each in kind.coefficients}
    assert form is not None  # a law over points is no memory
    columns = form.columns(law.x, values.get(form.shape, 0.0))
    change = sum((values[name] * column for name, column in zip(form.coefficients, columns, strict=True)
                  if name in values), np.zeros(len(law.x)))
    flat = flat_forms(len(law.x))[:, :law.known_up_to]
    return np.asarray(change - flat @ np.linalg.lstsq(flat, change)[0])
