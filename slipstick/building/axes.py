"""Axes of a table from the spans of parameters, in multiples of their values in the model."""

from collections.abc import Mapping, Sequence

import numpy as np

from slipstick.bench import parameters
from slipstick.black_box import BlackBoxDescription
from slipstick.errors import InvalidValue
from slipstick.table import Axis
from slipstick.table.subject import Subject, input_of

Spans = Mapping[str, Sequence[float]]
"""Parameter -> (low, high, count) of an axis of a grid, or (low, high) of one of a surrogate."""
_GRID, _BOX = ("low", "high", "count"), ("low", "high")
_MOST_POINTS = 1_000_000
"""Grid points of one axis: no memory holds a table of more."""


def axes_of(subject: Subject, spans: Spans, counted: bool = True) -> tuple[Axis, ...]:
    """An axis for each of the `spans`: (low, high, count) of equidistant points, or (low, high) unless `counted`.

    Raises `UnknownName` for something that is no parameter or input of the `subject`, and `InvalidValue`, also for a
    span beyond the range of an input of a black box, and for one of which the model of a clutch has no meaning.
    """
    if not isinstance(spans, Mapping):
        raise InvalidValue(f"The axes are {spans!r:.60}", 'Give a mapping, such as {"pressure_bias": (0.8, 1.2, 25)}')
    if not spans:
        raise InvalidValue("The table has no axes", "Give one or more parameters with their spans")
    return tuple(_axis(subject, name, span, counted) for name, span in spans.items())


def _axis(subject: Subject, name: str, span: Sequence[float], counted: bool) -> Axis:
    unit, nominal = input_of(subject, name)
    form = _GRID if counted else _BOX
    remedy = f"Give ({', '.join(form)}) in multiples of its value in the model, such as (0.8, 1.2{', 25' * counted})"
    try:
        low, high, count = *map(float, span[:2]), float(span[2]) if counted else 2.0
        is_valid = len(span) == len(form) and count.is_integer()
    except (TypeError, ValueError, IndexError, KeyError):
        is_valid = False
    if not is_valid:
        raise InvalidValue(f"The span of the axis {name} is {span!r}", remedy)
    if not 2 <= count <= _MOST_POINTS:
        raise InvalidValue(f"The axis {name} has {count:,.0f} point(s)", f"Give 2 to {_MOST_POINTS:,}")
    if isinstance(subject, BlackBoxDescription):
        _require_range(subject, name, low, high)
    else:
        _require_meaning(name, nominal, unit, low)
    if not low < high < np.inf or low == -np.inf:
        raise InvalidValue(f"The axis {name} from {low:g} to {high:g} does not increase or is not finite", remedy)
    return Axis(name, np.linspace(low, high, int(count)), nominal, unit)


def _require_meaning(name: str, nominal: float, unit: str, low: float) -> None:
    if nominal == 0:
        raise InvalidValue(f"The axis {name} has multiples of 0 {unit}, which are all 0",
                           "Give the parameter another value in the bench or the model, or leave out the axis")
    if low <= 0 and parameters.PARAMETERS[parameters.index(name)].positive:  # as a bench file requires
        raise InvalidValue(f"The axis {name} begins at {low:g} times {nominal:g} {unit}, "
                           "and the model needs a positive value", "Give a positive lowest multiple")


def _require_range(subject: BlackBoxDescription, name: str, low: float, high: float) -> None:
    entry = subject.input(name)
    if low < entry.lower or high > entry.upper:
        raise InvalidValue(f"The axis {name} from {low:g} to {high:g} exceeds the range of the input, "
                           f"{entry.lower:g} to {entry.upper:g}",
                           "Narrow the axis, or widen the range in the file of the machine: `range` of the input, or "
                           "`scatter` or `within` of a parameter that is declared in Python")
