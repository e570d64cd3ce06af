"""Equations with their coefficients in numbers."""

import re
from collections.abc import Mapping


def insert_values(formula: str, coefficients: Mapping[str, tuple[float, str]]) -> str:
    """The formula with coefficients, each a value and its unit, for their names, such as `signal + (0.0035 N m)`."""
    return re.sub(r"\w+", lambda word: describe_value(*coefficients[word[0]]) if word[0] in coefficients else word[0],
                  formula)


def describe_value(value: float, unit: str) -> str:
    """A number in its unit, in brackets unless it is positive and has none."""
    text = f"{value:.4g}" if unit in ("", "1") else f"{value:.4g} {unit}"
    return text if re.fullmatch(r"[\d.]+", text) else f"({text})"
