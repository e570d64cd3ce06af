"""Physical quantities as text, such as "50 ms" or "1000 rpm", converted by pint to the units of the model."""

import re
from functools import cache
from typing import Any

import numpy as np

_POWER = re.compile(r"(\^|\*\*)\s*[-+]?\d(\.\d+)?(?![\d.])")
_ARITHMETIC = re.compile(r"~[\s)]*~|\^|\*\*|(?<![\w.])(?!1(?!\w|\.))[\d.]")
"""Powers (~) of powers, and numbers other than the 1 of 1/s: pint would evaluate them, and 9^9^9 does not end."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_CELSIUS = re.compile(r"\bdegC\b")
_BRACKETS = re.compile(r"(?<=/)\(([^\W\d]+|°C)\)")
"""Brackets below a fraction about a single unit."""
_TORQUE = re.compile(r"(/\s*)?(?<![^\W\d_])([kmMµμ]?N)m(s?)((?:\^|\*\*)-?\d+|[²³])?(?![^\W\d_])")
"""Newton metres in a word, such as mNm and Nms, which pint takes for textile counts (number of metres)."""
_WHOLE_EXPONENT = re.compile(r"\^(-?\d+)(?![.\d])")


def raised(unit: str) -> str:
    """The unit, or a text with units, as people read it: N m s², °C and 1/bar for N m s^2, degC and 1/(bar)."""
    plain = _BRACKETS.sub(lambda match: match[1], _CELSIUS.sub("°C", unit))
    return _WHOLE_EXPONENT.sub(lambda match: match[1].translate(_RAISED), plain)


def describe_quantity(name: str, value: float, unit: str, digits: int = 5) -> str:
    """Return a named number with its unit as people read it, such as `load inertia 6 kg m²`; "1" is no unit."""
    return f"{name} {value:.{digits}g}" + f" {raised(unit)}" * (unit not in ("", "1"))


class NotAQuantity(ValueError):
    """The text is no number with a unit of the wanted dimension; the message says why.

    `remedy` is how to correct the unit, empty where the text has no unit, or no number, at its place.
    `is_other_quantity` tells that the unit is one of another dimension.
    """

    def __init__(self, cause: str, remedy: str = "", is_other_quantity: bool = False) -> None:
        super().__init__(cause)
        self.remedy, self.is_other_quantity = remedy, is_other_quantity


def in_unit(value: Any, unit: str) -> float:
    """A number in `unit`, from "<number> <unit>" or, where the model's unit is 1, from a plain number.

    Raises `NotAQuantity` where the unit is missing, unknown, or of another dimension, or the number is not finite.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise NotAQuantity(f"{value!r} is not a quantity")
    number, _, written = str(value).strip().partition(" ")
    try:
        plain = float(number)
    except ValueError:
        form = "a number" if unit == "1" else "a number, a space and its unit"
        raise NotAQuantity(f"'{str(value)[:60]}' is not {form}") from None
    return float(convert(np.array(plain), written.strip(), unit))


def convert(values: np.ndarray, written: str, unit: str) -> np.ndarray:
    """`values` (any shape) from the unit `written` to `unit`, same shape; raises `NotAQuantity`."""
    if not np.all(np.isfinite(values)):
        raise NotAQuantity("a number is not finite")
    if not written:
        if unit != "1":
            raise NotAQuantity(f"the unit is missing; the model uses {unit}")
        return values
    if _spell_out(written) == _spell_out(unit):  # also spares the import of pint
        return values
    spelled = "rpm or rad/s" if unit == "rad/s" else unit
    other = "Give plain numbers, without a unit" if unit == "1" else \
        f"State the unit that the numbers have, spelled such as {spelled}, or convert the numbers to {unit}"
    if _ARITHMETIC.search(_POWER.sub("~", written)):
        raise NotAQuantity(f"the unit '{written[:40]}' is not a product of units and their powers, such as N m^2 s",
                           other)
    registry = unit_registry()
    try:
        given, wanted = (registry.parse_units(_spell_out(each)) for each in (written, unit))
        zero, factor = (registry.Quantity(number, given).to(wanted).magnitude for number in (0.0, 1.0))
    except Exception as error:  # pint raises tokenizer, attribute and arithmetic errors on malformed text
        raise NotAQuantity(f"the unit '{written[:40]}' cannot be converted to {unit} ({_tell_reason(error)})",
                           other, _is_other_quantity(error)) from None
    if "radian" in _base(unit) and "radian" not in _base(written):
        # To pint 1/min is the same as rad/min, and a motor speed in revolutions per minute would be wrong by 2 pi.
        raise NotAQuantity(f"the unit '{written[:40]}' does not say which angle, such as rpm or rad/s",
                           "Write rpm (for 1/min) or revolution/s (for 1/s or Hz) in its place if it counts revolu"
                           f"tions, rad/min or rad/s if radians, or convert the numbers to {unit}")
    # A degree Celsius has another zero than a kelvin.
    converted: np.ndarray = registry.Quantity(values, given).to(wanted).magnitude if zero else values * factor
    return converted


def factor_of(written: str, unit: str) -> float:
    """What numbers in the unit `written` are multiplied by to be in `unit`; raises `NotAQuantity`."""
    zero, factor = convert(np.array([0.0, 1.0]), written, unit).tolist()
    if zero:
        raise NotAQuantity(f"the zeros of {written} and {unit} differ", f"Convert the numbers to {unit}")
    return float(factor)


def is_unit(written: str) -> bool:
    """Whether the text is a unit, of whatever dimension."""
    if not written or _ARITHMETIC.search(_POWER.sub("~", written)):
        return written == "1"
    try:
        unit_registry().parse_units(_spell_out(written))
    except Exception:  # pint raises tokenizer, attribute and assertion errors on other text
        return False
    return True


def _base(unit: str) -> list[str]:
    """The base units of a unit; pint counts the radian among them, though it has no dimension."""
    return list(unit_registry().get_root_units(_spell_out(unit))[1]._units)


def _spell_out(unit: str) -> str:
    """A unit with newton metres as pint reads them: those below a fraction stay there together."""
    def apart(match: re.Match[str]) -> str:
        below, newton, second, exponent = (group or "" for group in match.groups())
        product = f"{newton} m{' s' * bool(second)}{exponent}"
        return f"/({product})" if below else product

    return _TORQUE.sub(apart, unit)


def _tell_reason(error: Exception) -> str:
    """Why pint does not convert a unit, in words that are not those of pint."""
    import pint

    if _is_other_quantity(error):
        return "they are units of different quantities"
    if isinstance(error, pint.UndefinedUnitError):
        names = (error.unit_names,) if isinstance(error.unit_names, str) else error.unit_names
        return f"'{next(iter(names))[:40]}' is not a known unit"
    return "it is not a unit"


def _is_other_quantity(error: Exception) -> bool:
    import pint

    return isinstance(error, pint.DimensionalityError)


@cache
def unit_registry() -> Any:
    """The units that pint knows, made at the first call, which takes a third of a second."""
    import pint  # takes a second to import, and most runs read units that need no conversion

    return pint.UnitRegistry()
