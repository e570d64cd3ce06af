"""The shape of a law: what can be tested on a measured change of a quantity, whatever its formula.

A shape is a set of linear inequalities between the differences of the law: their signs, the signs of the differences
of slopes, and how much of the change lies near zero. The laws that fulfil them form a convex cone. A measured law with
an error is tested by its distance from the nearest law of the cone, weighted with the inverse covariance.
"""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import scipy

from slipstick.errors import InvalidValue, UnknownName

Direction = Literal["rises", "falls", "either", "any"]
Curvature = Literal["convex", "concave", "either", "any"]

_ROUNDING = 1e-9
"""Violations below this share of the largest difference are rounding errors, and so are variances below its square."""
_WORDS = {
    ("rises", "convex"): "rises ever more steeply", ("rises", "concave"): "rises and flattens",
    ("falls", "convex"): "falls and flattens", ("falls", "concave"): "falls ever more steeply",
    ("any", "convex"): "is convex", ("any", "concave"): "is concave", ("any", "either"): "is convex or concave",
    ("any", "any"): "has any shape",
}


@dataclass(frozen=True)
class Shape:
    """The shape of a law y(x), up to a constant.

    `direction` is the sign of its slope and `curvature` that of the change of its slope; "either" is one sign
    throughout, "any" is not tested. With `near_zero` at least half of the change lies below half of the largest x.
    Raises `UnknownName` for another word, `InvalidValue` for `near_zero` without a direction.
    """

    direction: Direction = "any"
    curvature: Curvature = "any"
    near_zero: bool = False

    def __post_init__(self) -> None:
        """Reject words that would never be tested."""
        for kind, word, known in (("direction of a law", self.direction, get_args(Direction)),
                                  ("curvature of a law", self.curvature, get_args(Curvature))):
            if word not in known:
                raise UnknownName.of(kind, word, known)
        if self.near_zero and self.direction == "any":
            raise InvalidValue("A law that changes most near zero has no direction",
                               "Give the direction 'rises', 'falls' or 'either'")

    @property
    def words(self) -> str:
        """The shape in words, to follow "the law", such as "rises and flattens"."""
        rising = "rises or falls throughout" if self.direction == "either" else self.direction
        bent = {"any": "", "either": ", convex or concave"}.get(self.curvature, f", {self.curvature}")
        words = _WORDS.get((self.direction, self.curvature), rising + bent)
        return words + (", most of it near zero" if self.near_zero else "")

    def is_met(self, x: np.ndarray, change: np.ndarray, covariance: np.ndarray | None = None,
               level: float = 0.01) -> bool:
        """Whether a law measured at the ascending `x` (k,), with `change` (k,), can have this shape.

        Without `covariance` (k, k) the law is exact. With it, a law that has the shape is rejected with a probability
        of at most `level`: the squared distance from the nearest law with the shape is compared with the quantile of
        chi-square with as many degrees of freedom as there are inequalities that hold this nearest law.
        Raises `InvalidValue` for arrays that define no law.
        """
        x, change = np.asarray(x, float), np.asarray(change, float)
        _check(x, change, covariance, level)
        return any(_is_met(inequalities, np.diff(change), covariance, level) for inequalities in self._cones(x))

    def _cones(self, x: np.ndarray) -> list[np.ndarray]:
        """The inequalities A d >= 0 of the differences d of a law, (m, k-1): one A for each choice of signs."""
        slopes = 1 / np.diff(x)[:, None] * np.eye(len(x) - 1)
        bends = np.diff(slopes, axis=0)
        below = np.clip((0.5 * x[-1] - x[:-1]) / np.diff(x), 0, 1)  # share of each step in the lower half
        towards_zero = (2 * below - 1)[None, :]
        signs = {"rises": (1,), "falls": (-1,), "convex": (1,), "concave": (-1,), "either": (1, -1), "any": (0,)}
        cones = []
        for slope in signs[self.direction]:
            for bend in signs[self.curvature]:
                parts = [slope * slopes, bend * bends, slope * self.near_zero * towards_zero]
                rows = np.concatenate([part for part in parts if np.any(part)] or [slopes[:0]])
                cones.append(rows / np.linalg.norm(rows, axis=1, keepdims=True))
        return cones


def _is_met(inequalities: np.ndarray, differences: np.ndarray, covariance: np.ndarray | None, level: float) -> bool:
    """Whether d, (k-1,), fulfils A d >= 0 within its error.

    The nearest law is d + S S' A' f with the forces f >= 0 that minimize |S' A' f + S^-1 d|^2, where S S' is the
    covariance of d. A force is positive where an inequality holds the nearest law.
    """
    if not len(inequalities):
        return True
    if covariance is None:
        return bool(np.min(inequalities @ differences) >= -_ROUNDING * np.abs(differences).max())
    variances, directions = np.linalg.eigh(np.diff(np.diff(covariance, axis=0), axis=1))
    std = np.sqrt(np.maximum(variances, _ROUNDING**2 * variances[-1]))
    forces, _ = scipy.optimize.nnls((inequalities @ directions * std).T, -(directions.T @ differences) / std)
    violated = int(np.sum(forces > 0))
    distance = std * (forces @ inequalities @ directions)
    return violated == 0 or bool(distance @ distance <= scipy.special.chdtri(violated, level))


def _check(x: np.ndarray, change: np.ndarray, covariance: np.ndarray | None, level: float) -> None:
    """Raise `InvalidValue` for arrays of other shapes, not finite, or with x that does not ascend."""
    k = len(x)
    if x.shape != (k,) or change.shape != (k,) or k < 2 or (covariance is not None and covariance.shape != (k, k)):
        raise InvalidValue(f"A law has {x.shape} points, {change.shape} changes and the covariance "
                           f"{None if covariance is None else covariance.shape}",
                           "Give at least two points (k,), changes (k,), and a covariance (k, k) or none")
    numbers = [x, change] if covariance is None else [x, change, covariance.ravel()]
    if not np.all(np.isfinite(np.concatenate(numbers))) or np.any(np.diff(x) <= 0):
        raise InvalidValue("A law has points that do not ascend, or numbers that are not finite",
                           "Sort the points, take each once, and leave out what was not measured")
    if covariance is not None and not np.trace(np.diff(np.diff(covariance, axis=0), axis=1)) > 0:
        raise InvalidValue("The covariance says that the differences of a law have no error",
                           "Leave it out for an exact law")
    if not 0 < level < 1:
        raise InvalidValue(f"The level is {level:g}", "Give a probability between 0 and 1")
