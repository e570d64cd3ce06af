"""Units as files spell them, and values in the units of the model."""

import re

import numpy as np

from slipstick.errors import BadRecording
from slipstick.numerics.quantities import NotAQuantity, convert, is_unit

_BRACKET = re.compile(r"(?P<name>.+?)\s*[\[(](?P<content>[^\[\]()]*)[\])]")
_SPELLINGS = {"U/min": "rpm", "kgm²": "kg m^2", "kgm^2": "kg m^2", "Sec": "s", "sec": "s", "-": "1"}
"""Unit of a file -> the same unit as pint reads it. Of 1/min it is not known whether it means revolutions."""


def spelled(unit: str) -> str:
    """A unit as pint reads it."""
    return _SPELLINGS.get(unit.strip(), unit.strip())


def split_unit(heading: str) -> tuple[str, str]:
    """Name and unit of a heading such as `n_mot [rpm]` or `n_mot (rpm)`.

    A bracket that holds no unit, as in `p (front)`, or a number without a space before, as in `M[1]`, belongs to the
    name; the unit is then "".
    """
    name, unit = split_bracket(heading)
    is_element = unit.isdigit() and not heading[len(name):].startswith(" ")
    return (name, unit) if is_unit(spelled(unit)) and not is_element else (heading.strip(), "")


def split_bracket(heading: str) -> tuple[str, str]:
    """A heading without the bracket at its end, and what is in it, "" for none."""
    parts = _BRACKET.fullmatch(heading.strip())
    return (parts["name"], parts["content"].strip()) if parts else (heading.strip(), "")


def convert_to(unit: str, written: str, values: np.ndarray, where: str) -> np.ndarray:
    """Values of any shape in `unit` from those in `written`, missing ones as NaN.

    Raises `BadRecording`, where `where` names file and channel.
    """
    known = np.isfinite(values)
    try:
        converted = convert(np.where(known, values, 0.0), spelled(written), unit)
    except NotAQuantity as error:
        if error.is_other_quantity:
            raise BadRecording(f"{where} has the unit {written}, which is no unit of a quantity in {unit}",
                               "Check that it is the right channel; if it is, state the unit of its numbers") from None
        raise BadRecording(f"{where}: {error}", f"State the unit of its numbers, such as {unit}") from None
    return np.where(known, converted, np.nan)
