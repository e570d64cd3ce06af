"""Equations with their coefficients in numbers."""

import re
from collections.abc import Iterable
from typing import Protocol


class Coefficient(Protocol):
    """A value in a unit."""

    @property
    def name(self) -> str:
        """The name in an equation."""

    @property
    def value(self) -> float:
        """The value, in `unit`."""

    @property
    def unit(self) -> str:
        """The unit, "1" or empty without one."""


def insert_values(formula: str, coefficients: Iterable[Coefficient]) -> str:
    """The formula with the values of its coefficients for their names, such as `signal + (0.0035 N m)`."""
    values = {each.name: describe_value(each.value, each.unit) for each in coefficients}
    return re.sub(r"\w+", lambda word: values.get(word[0], word[0]), formula)


def describe_value(value: float, unit: str) -> str:
    """A number in its unit, in brackets unless it is positive and has none."""
    text = f"{value:.4g}" if unit in ("", "1") else f"{value:.4g} {unit}"
    return text if re.fullmatch(r"[\d.]+", text) else f"({text})"
