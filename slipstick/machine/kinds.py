"""Kinds of effects: forms with few coefficients over what a quantity depends on, and at most one shape."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

_SHAPES = 24
"""Values of a shape that are compared."""

Columns = Callable[[np.ndarray, float], list[np.ndarray]]


@dataclass(frozen=True)
class Kind:
    """A form over x with these `coefficients`, in powers (`degrees`) of the unit of x, and the name of its `shape`.

    `columns` maps x (m,) and a shape to a column (m,) for each coefficient. x crosses 0 if it `needs_sign`. The
    `shapes` to compare are computed from x.
    """

    name: str
    coefficients: tuple[str, ...]
    degrees: tuple[int, ...]
    columns: Columns
    shape: str = ""
    needs_sign: bool = False
    shapes: Callable[[np.ndarray], np.ndarray] = lambda x: np.ptp(x) * np.geomspace(0.01, 1, _SHAPES)


def _list_places(x: np.ndarray) -> np.ndarray:
    return np.linspace(x[0], x[-1], _SHAPES + 2)[1:-1]


def _list_periods(x: np.ndarray) -> np.ndarray:
    return np.asarray(np.ptp(x) / np.arange(1, _SHAPES // 2))


KINDS = (
    Kind("constant", ("change",), (0,), lambda x, _: [np.ones_like(x)]),
    Kind("proportional", ("slope",), (1,), lambda x, _: [x]),
    Kind("linear", ("change at 0", "slope"), (0, 1), lambda x, _: [np.ones_like(x), x]),
    Kind("quadratic", ("change at 0", "slope", "curvature"), (0, 1, 2), lambda x, _: [np.ones_like(x), x, x**2]),
    Kind("linear in the magnitude", ("change at 0", "slope"), (0, 1), lambda x, _: [np.ones_like(x), np.abs(x)],
         needs_sign=True),
    Kind("Coulomb friction", ("level",), (0,), lambda x, _: [np.sign(x)], needs_sign=True),
    Kind("Coulomb and viscous friction", ("level", "slope"), (0, 1), lambda x, _: [np.sign(x), x], needs_sign=True),
    Kind("Stribeck friction", ("level", "rise at rest", "slope"), (0, 0, 1),
         lambda x, at: [np.sign(x), np.sign(x) * np.exp(-np.abs(x) / at), x], "speed of the fall", needs_sign=True),
    Kind("quadratic drag", ("drag",), (2,), lambda x, _: [x * np.abs(x)], needs_sign=True),
    Kind("deadband", ("slope",), (1,), lambda x, at: [x - np.clip(x, -at, at)], "half width", needs_sign=True),
    Kind("above a threshold", ("slope",), (1,), lambda x, at: [np.maximum(x - at, 0)], "threshold",
         shapes=_list_places),
    Kind("below a threshold", ("slope",), (1,), lambda x, at: [np.minimum(x - at, 0)], "threshold",
         shapes=_list_places),
    Kind("step", ("before", "after"), (0, 0), lambda x, at: [(x < at) * 1.0, (x >= at) * 1.0], "place",
         shapes=_list_places),
    Kind("saturation", ("slope",), (1,), lambda x, at: [np.clip(x, -at, at)], "limit"),
    Kind("approach", ("end", "begin"), (0, 0),
         lambda x, at: [1 - np.exp(-(x - x[0]) / at), np.exp(-(x - x[0]) / at)], "scale"),
    Kind("ripple", ("mean", "cosine", "sine"), (0, 0, 0), lambda x, at: [
        np.ones_like(x), np.cos(2 * np.pi * x / at), np.sin(2 * np.pi * x / at)], "period", shapes=_list_periods),
)
"""Kinds of laws over a variable, of any machine; a machine may have others (`Effect`)."""

MEMORIES = "play", "dead time", "first-order lag"
"""Kinds of laws over the past of a signal."""

TERMS = {
    "constant": {"change": "1"},
    "proportional": {"slope": "x"},
    "linear": {"change at 0": "1", "slope": "x"},
    "quadratic": {"change at 0": "1", "slope": "x", "curvature": "x^2"},
    "linear in the magnitude": {"change at 0": "1", "slope": "abs(x)"},
    "Coulomb friction": {"level": "sign(x)"},
    "Coulomb and viscous friction": {"level": "sign(x)", "slope": "x"},
    "Stribeck friction": {"level": "sign(x)", "rise at rest": "sign(x) * exp(-abs(x) / S)", "slope": "x"},
    "quadratic drag": {"drag": "x * abs(x)"},
    "deadband": {"slope": "(x - min(S, max(-S, x)))"},
    "above a threshold": {"slope": "max(0, x - S)"},
    "below a threshold": {"slope": "min(0, x - S)"},
    "step": {"before": "(x < S)", "after": "(x >= S)"},
    "saturation": {"slope": "min(S, max(-S, x))"},
    "approach": {"end": "(1 - exp(-(x - B) / S))", "begin": "exp(-(x - B) / S)"},
    "ripple": {"mean": "1", "cosine": "cos(2 * pi * x / S)", "sine": "sin(2 * pi * x / S)"},
    MEMORIES[0]: {"share": "((x after a play of half width S) - x)"},
    MEMORIES[1]: {"share": "((x after a dead time of S) - x)"},
    MEMORIES[2]: {"share": "((x after a first-order lag of S) - x)"},
}
"""Name of a kind -> the term of each coefficient as text, with the variable x, its smallest value B, and the shape S.

They are no part of `Kind`, because texts do not count in the digest of a study.
"""
