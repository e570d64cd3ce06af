"""Numbers with units as people read them: 0.07 mm rather than 7e-05 m."""

from slipstick.numerics.quantities import raised

__all__ = ["fixed", "number", "raised", "scale", "signed", "with_unit"]

_SCALES = {"m": (("m", 1.0), ("mm", 1e3)), "m/s": (("m/s", 1.0), ("mm/s", 1e3)), "s": (("s", 1.0), ("ms", 1e3)),
           "A": (("A", 1.0), ("mA", 1e3)), "bar": (("bar", 1.0), ("mbar", 1e3)), "rad": (("rad", 1.0), ("mrad", 1e3)),
           "rad/(N m)": (("rad/(N m)", 1.0), ("mrad/(N m)", 1e3)),
           "m/bar": (("m/bar", 1.0), ("mm/bar", 1e3)), "m/(s bar)": (("m/(s bar)", 1.0), ("mm/(s bar)", 1e3)),
           "N m/Pa": (("N m/bar", 1e5),),
           "Pa": (("MPa", 1e-6), ("kPa", 1e-3), ("Pa", 1.0))}
"""Unit -> units in which it may be shown with the factor from it to them, from large to small."""
_LEAST = 0.1
"""Smallest number that is shown in a unit if a smaller unit exists."""


def scale(unit: str, largest: float, share: bool = False) -> tuple[str, float]:
    """The unit in which values up to `largest` in `unit` are shown, and the factor to it; a `share` is shown in %."""
    if share:
        return "%", 100.0
    if unit not in _SCALES:
        return raised(unit), 1.0
    return next((shown for shown in _SCALES[unit] if abs(largest) * shown[1] >= _LEAST), _SCALES[unit][-1])


def number(value: float, digits: int = 3) -> str:
    """A number with significant digits and a true minus sign."""
    text = f"{value:.{digits}g}"
    return (f"{value:.0f}" if "e+" in text else text).replace("-", "−")


def with_unit(text: str, unit: str) -> str:
    """The text and its unit; "1" is no unit."""
    return text if unit in ("", "1") else f"{text} {unit}"


def signed(value: float, digits: int = 3) -> str:
    """A number with its sign, also if positive."""
    return f"{'+' if value > 0 else ''}{number(value, digits)}"


def fixed(value: float, digits: int = 3) -> str:
    """A number with significant digits, zeros included: 13.0."""
    text = f"{value:.0f}" if abs(value) >= 10 ** (digits - 1) else f"{value:#.{digits}g}"
    return "0" if value == 0 else text.replace("-", "−")
