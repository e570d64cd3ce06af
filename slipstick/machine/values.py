"""What the values of a declaration must be: tuples where there may be several, numbers with a sign, rising instants."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from numbers import Real
from typing import Any

from slipstick.errors import InvalidValue


def require_tuples(declared: Any, place: str, names: Iterable[str]) -> None:
    """Raise `InvalidValue` where a field of what is `declared` is a single thing: a tuple of one has a comma."""
    for name in names:
        value = getattr(declared, name)
        if not isinstance(value, Sequence) or isinstance(value, str):
            shown = repr(value) if isinstance(value, str | Real) else f"a single {type(value).__name__}"
            raise InvalidValue(f"{place} has {shown} as its {name}, which must be a tuple",
                               f"Write {name}=(...,): also a tuple of one has a comma")


def require_numbers(declared: Any, place: str, *, above: Iterable[str] = (), least: Iterable[str] = (),
                    other: Iterable[str] = ()) -> None:
    """Raise `InvalidValue` where a field is no number, is not `above` 0, or is not 0 at `least`; None stays."""
    above, least = tuple(above), tuple(least)
    for name in (*above, *least, *other):
        value = getattr(declared, name)
        if value is None:
            continue
        if not isinstance(value, Real) or isinstance(value, bool) or math.isnan(value):
            raise InvalidValue(f"{place} has {value!r} as its {name}, which is no number",
                               f"Give a number without a unit, such as {name}=1.0")
        if (name in above and value <= 0) or (name in least and value < 0):
            raise InvalidValue(f"{place} has {value!r} as its {name}",
                               f"Give a number above 0{'' if name in above else ', or 0'}")


def require_corners(profiles: Any, place: str) -> None:
    """Raise `InvalidValue` where the corners of a profile are no pairs, or their instants fall."""
    for number, corners in enumerate(profiles):
        try:
            instants = [float(instant) for instant, _ in corners]
        except (TypeError, ValueError):
            raise InvalidValue(f"Profile {number} of {place} is no tuple of corners",
                               "Give profiles=(((time, value), (time, value)), ...): tuples of pairs") from None
        for before, after in pairwise(instants):
            if after < before:
                raise InvalidValue(f"Profile {number} of {place} goes back from {before:g} s to {after:g} s",
                                   "Sort its corners by time")
