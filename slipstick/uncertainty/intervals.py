"""Profile-likelihood intervals, and which combinations of the unknowns the recordings identify.

The profile of an unknown is the greatest log-likelihood at each of its values, all other unknowns free. Its interval
ends where the profile has dropped by half a chi-square quantile (Wilks 1938), and stays open at a bound of the search
where the drop is less: there the recordings do not say.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from slipstick.uncertainty.gradient import with_gradient
from slipstick.uncertainty.likelihood import Problem
from slipstick.uncertainty.refine import climb
from slipstick.uncertainty.unknowns import Unknowns

_SOLVES = 6  # of the others, to find one end
_CLOSE = 0.03  # of the drop in decades: near enough to an end
IDENTIFIED = 0.25
"""A combination is identified where its standard error is below this share of the range it can take in the search."""


@dataclass(frozen=True, eq=False)
class Interval:
    """An unknown with its profile `curve` (p, 2): value and drop in decades; an end is None where it is open."""

    unknown: str
    estimate: float
    lower: float | None
    upper: float | None
    level: float
    curve: np.ndarray


@dataclass(frozen=True, eq=False)
class Combination:
    """A direction (k,) of unit length in the unknowns, as shares of their ranges, and the standard error along it."""

    weights: np.ndarray
    std_error: float
    identified: bool


def interval(problem: Problem, space: Unknowns, found: np.ndarray, place: int, level: float) -> Interval:
    """The profile-likelihood interval of unknown `place` about the maximum `found` (k,), on the scale of its name."""
    top = float(with_gradient(problem, space, found)[0].sum())
    allowed = drop_at(level)
    error = standard_errors(problem, space, found)[place]
    scale: Callable[[float], float] = (lambda value: value) if is_plain(space, place) else (lambda v: float(np.exp(v)))
    rows, ends = [(float(found[place]), 0.0)], []
    for side, bound in ((-1, space.lower[place]), (1, space.upper[place])):
        end, points = _end(problem, space, found, place, top, allowed, side * error, float(bound))
        rows += points
        ends.append(end)
    curve = np.array([[scale(value), drop] for value, drop in sorted(rows)])
    low, high = (None if end is None else scale(end) for end in ends)
    return Interval(space.names[place], scale(float(found[place])), low, high, level, curve)


def combinations(problem: Problem, space: Unknowns, found: np.ndarray) -> list[Combination]:
    """Orthogonal directions from the best to the least identified, from the information in the scores."""
    values, vectors = np.linalg.eigh(_information(problem, space, found))
    errors = 1 / np.sqrt(np.maximum(values, 1e-12))
    return [Combination(vector * np.sign(vector[np.argmax(np.abs(vector))]), float(error), bool(error < IDENTIFIED))
            for vector, error in zip(vectors.T[::-1], errors[::-1], strict=True)]


def standard_errors(problem: Problem, space: Unknowns, found: np.ndarray) -> np.ndarray:
    """Standard error of each unknown by the information in the scores, shape (k,), at most its range."""
    span = space.upper - space.lower
    covariance = np.linalg.inv(_information(problem, space, found) + np.eye(len(span)))
    errors: np.ndarray = np.sqrt(np.diag(covariance)) * span
    return errors


def drop_at(level: float) -> float:
    """Decades by which a profile drops at the ends of an interval of `level`."""
    return float(chi2.ppf(level, 1) / 2 / np.log(10.0))


def is_plain(space: Unknowns, place: int) -> bool:
    """Whether an unknown is searched as it is, and not as a logarithm."""
    d = len(space.axes)
    return not d <= place <= 2 * d


def _information(problem: Problem, space: Unknowns, found: np.ndarray) -> np.ndarray:
    gradient = with_gradient(problem, space, found)[1] * np.log(10.0) * (space.upper - space.lower)
    information: np.ndarray = gradient.T @ gradient
    return information


def _end(problem: Problem, space: Unknowns, found: np.ndarray, place: int, top: float, allowed: float, step: float,
         bound: float) -> tuple[float | None, list[tuple[float, float]]]:
    """Where the profile has dropped by `allowed` decades on one side, None where it never does; and its points."""
    free = np.arange(len(found)) != place
    points: list[tuple[float, float]] = []
    inside, outside, start = (float(found[place]), 0.0), None, found
    value = found[place] + step * np.sqrt(chi2.ppf(0.9, 1))
    for _ in range(_SOLVES):
        value = float(np.clip(value, space.lower[place], space.upper[place]))
        vector = start.copy()
        vector[place] = value
        start, reached = climb(problem, space, vector, free)
        drop = max(top - reached, 0.0)
        points.append((value, drop))
        if abs(drop - allowed) < _CLOSE * allowed:
            return value, points
        if drop < allowed:
            inside = (value, drop)
            if value == bound:
                return None, points
        else:
            outside = (value, drop)
        if outside is None:  # twice as far, then straight to the bound
            value = bound if len(points) > 2 else found[place] + 2 * (value - found[place])
        else:  # the root of the drop is nearly straight
            low, high = np.sqrt(inside[1]), np.sqrt(outside[1])
            value = inside[0] + (outside[0] - inside[0]) * (np.sqrt(allowed) - low) / (high - low)
    return value, points
