"""Names and numbers of a study in words."""

from math import floor, inf, log10

from slipstick.clutch.effects import Effect
from slipstick.pictures import units
from slipstick.pictures.theme import in_words
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.studies.result import WITHIN, Closure, Coefficient

CHANNELS = {name: (unit, 1.0) for name, unit in SIGNAL_UNITS.items()} | {
    "shifting_time": ("ms", 1e3), WITHIN: ("noise", 1.0)}
"""Signal, shifting time or all within engagements -> displayed unit, and the factor from that of the result to it."""
MISFIT = 1.5
"""Reduced chi-square above which a signal holds more than noise."""


def meaning(effect: Effect | None, name: str) -> str:
    """The meaning of a coefficient."""
    if name == "factor":
        return "multiple of the measured law, 1 if the simulation agrees with it"
    if effect is None:
        return ""
    return next((coefficient.meaning for coefficient in effect.coefficients if coefficient.name == name), "")


def coefficient_row(coefficient: Coefficient, effect: Effect | None) -> tuple[str, ...]:
    """Name, estimate, interval and meaning, in one readable unit."""
    unit, factor = units.scale(coefficient.unit, coefficient.value)
    estimate = units.with_unit(units.fixed(factor * coefficient.value, 4), unit)
    if coefficient.at_bound:
        return in_words(coefficient.name), estimate, "none: at a bound of the search", meaning(effect, coefficient.name)
    interval = between(factor * coefficient.lower, factor * coefficient.upper, unit)
    return in_words(coefficient.name), estimate, interval, meaning(effect, coefficient.name)


def between(lower: float, upper: float, unit: str, at_bound: bool = False) -> str:
    """Both ends of an interval; "–" for one of an estimate `at_bound` that has no width."""
    if at_bound and units.fixed(lower, 4) == units.fixed(upper, 4):
        return "–"
    digits = digits_between(lower, upper)
    return units.with_unit(f"{units.fixed(lower, digits)} to {units.fixed(upper, digits)}", unit)


def digits_between(lower: float, upper: float) -> int:
    """Significant digits, four or more, in which the ends of an interval differ."""
    size, width = max(abs(lower), abs(upper)), upper - lower
    return max(4, 2 + floor(log10(size / width))) if 0 < width < size < inf else 4


def describe_closure(closure: Closure) -> str:
    """The closed share of a gap, with its interval."""
    if closure.closure is None or closure.lower is None or closure.upper is None:
        return "no significant gap"
    if closure.closure < 0:
        return f"{_share(closure.closure, closure.lower, closure.upper)}: the error grows"
    return _share(closure.closure, closure.lower, closure.upper)


def _share(share: float, lower: float, upper: float) -> str:
    """The share in %: an error by chance below that of a right model closes all of the gap, and no more."""
    return f"{100 * min(share, 1):.0f} % ({100 * lower:.0f} to {100 * upper:.0f})".replace("-", "−")


def percent(share: float) -> str:
    """A deviation in %."""
    text = f"{100 * share:+.2f} %"
    return "0 %" if not text.strip("+-0.% ") else text.replace("-", "−")


def many(count: int, noun: str) -> str:
    """A count with its noun."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
