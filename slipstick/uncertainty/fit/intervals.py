"""Profile-likelihood intervals, and which combinations of the unknowns the recordings identify.

The profile of an unknown, or of a weighted sum of unknowns, is the greatest log-likelihood at each of its values, all
else free. Its interval ends where the profile has dropped by half a chi-square quantile (Wilks 1938), and stays open
at a bound of the search where the drop is less: there the recordings do not say.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2

from slipstick.uncertainty.fit.refine import ROUNDS, constrained_maximum, information, local_problem, natural_scores
from slipstick.uncertainty.likelihood.likelihood import exact
from slipstick.uncertainty.likelihood.problem import InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns

_SOLVES = 12  # values tried between one inside and one outside
_CLOSE = 0.03  # of the drop: near enough to an end
_TOLERANCE = 1e-3  # decades to which each value of a profile is climbed
_JUMP = 0.3  # of the drop: a profile does not jump, so one that does was lost by a climb
_NEXT, _FURTHEST = 1.2, 3.0  # times as far is the next value, or else straight at the bound
_STEEPEST = 16.0  # times the drop: what lies beyond is taken as this, lest it outweigh what is near the end
IDENTIFIED = 0.25
"""A combination is identified where its standard error is below this share of the range it can take in the search."""
Near = tuple[InferenceProblem, Unknowns]
"""A problem to climb in, and the space it holds in (refine.nearby)."""


@dataclass(frozen=True, eq=False)
class Interval:
    """An interval with the profile `curve` (p, 2): value and drop in decades.

    An end is None where it is open, or where it was not found: then `unsettled` names it, "lower" or "upper", and the
    curve goes as far as the profile could be followed. `highest` is the vector (k,) of the least drop met, below 0
    where the estimate was no maximum.
    """

    estimate: float
    lower: float | None
    upper: float | None
    unsettled: tuple[str, ...]
    level: float
    curve: np.ndarray
    highest: np.ndarray


@dataclass(frozen=True, eq=False)
class Combination:
    """A direction (k,) of unit length in the unknowns, as shares of their ranges, and the standard error along it."""

    weights: np.ndarray
    std_error: float
    identified: bool


def profile_interval(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray, direction: np.ndarray, level: float) -> Interval:
    """The profile-likelihood interval of direction (k,) . plain about the maximum `optimum` (k,)."""
    profile = _Profile(problem, space, optimum, direction)
    allowed, ends, unsettled = drop_at_level(level), [], []
    for name, side in (("lower", -1), ("upper", 1)):
        try:
            ends.append(profile.end(side, allowed))
        except _NotFollowed:
            ends.append(None)
            unsettled.append(name)
    curve = np.array([[value, profile.points[value][0]] for value in sorted(profile.points)])
    _, highest, _ = min(profile.points.values(), key=lambda point: point[0])
    return Interval(profile.estimate, ends[0], ends[1], tuple(unsettled), level, curve, highest)


def profile_drop(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray, direction: np.ndarray, value: float) -> float:
    """Decades from the maximum `optimum` (k,) down to the profile where direction (k,) . plain has a value."""
    return _Profile(problem, space, optimum, direction).drop(value)


def combinations(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray) -> list[Combination]:
    """Orthogonal directions from the best to the least identified, from the information in the scores."""
    values, vectors = np.linalg.eigh(information(natural_scores(problem, space, optimum)[1] * _span(space)))
    errors = 1 / np.sqrt(np.maximum(values - 1, 1e-12))  # by the recordings alone, not by the range
    return [Combination(vector * np.sign(vector[np.argmax(np.abs(vector))]), float(error), bool(error < IDENTIFIED))
            for vector, error in zip(vectors.T[::-1], errors[::-1], strict=True)]


def direction_of(space: Unknowns, weights: np.ndarray) -> np.ndarray:
    """The direction (k,) that sums plain unknowns as shares of their ranges with these weights (k,)."""
    direction: np.ndarray = weights / _span(space)
    return direction


def drop_at_level(level: float) -> float:
    """Decades by which a profile drops at the ends of an interval of `level`."""
    return float(chi2.ppf(level, 1) / 2 / np.log(10.0))


def widest_identified_interval(level: float) -> float:
    """The widest interval of an identified combination: that of the standard error `IDENTIFIED`."""
    return float(2 * np.sqrt(chi2.ppf(level, 1)) * IDENTIFIED)


class _NotFollowed(Exception):
    """The climbs ran out before the profile was followed to its end."""


class _Profile:
    """The greatest likelihood at the values of direction . plain, each climbed to from what is known of the others.

    `points` is what is known: value -> drop in decades, the vector (k,) there, and where it was climbed to.
    """

    def __init__(self, problem: InferenceProblem, space: Unknowns, optimum: np.ndarray, direction: np.ndarray) -> None:
        self.problem, self.space, self.direction = problem, space, direction
        near = local_problem(problem, space, optimum)
        self.judge = replace(problem, direction=near[0].direction)
        self.top, self.optimum = self._height(optimum), space.to_natural(optimum)
        self.estimate = float(direction @ self.optimum)
        self.points: dict[float, tuple[float, np.ndarray, Near]] = {self.estimate: (0.0, optimum, near)}
        self.low, self.high = space.to_natural(space.lower), space.to_natural(space.upper)
        scores = natural_scores(*near, optimum)[1] * _span(space)
        covariance = np.linalg.inv(information(scores)) * np.outer(_span(space), _span(space))
        self.variance = float(direction @ covariance @ direction)
        self.path = covariance @ direction / self.variance  # by which the others follow a normal likelihood

    def end(self, side: int, allowed: float) -> float | None:
        """Where the profile has dropped by `allowed` decades below or above (`side`); None where it never does."""
        edges = np.sort([self.direction * self.low, self.direction * self.high], axis=0).sum(axis=1)
        low, high = float(edges[0]), float(edges[1])

        def excess(value: float) -> float:  # of the root of the drop, which is nearly straight
            drop = self.drop(value)
            close = abs(drop - allowed) < _CLOSE * allowed
            return 0.0 if close else float(np.sqrt(np.clip(drop, 0.0, _STEEPEST * allowed)) - np.sqrt(allowed))

        inside, step = self.estimate, side * float(np.sqrt(2 * np.log(10.0) * allowed * self.variance))
        while (surplus := excess(value := float(np.clip(self.estimate + step, low, high)))) < 0:
            if value in (low, high):
                return None
            further = np.sqrt(allowed) / max(np.sqrt(allowed) + surplus, 1e-9)
            inside, step = value, step * max(further, _NEXT) if further < _FURTHEST else side * np.inf
        if surplus == 0:
            return value if self.drop(value) > allowed or value not in (low, high) else None
        root, outcome = brentq(excess, inside, value, xtol=1e-3 * abs(value - inside), maxiter=_SOLVES,
                               full_output=True, disp=False)
        if not outcome.converged or abs(self.drop(float(root)) - allowed) > _JUMP * allowed:
            raise _NotFollowed
        return float(root)

    def drop(self, value: float) -> float:
        """Decades from the estimate down to the profile at a value."""
        if value not in self.points:
            nearest = min(self.points, key=lambda known: abs(known - value))
            _, beside, near = self.points[nearest]
            path = self.path if nearest == self.estimate else \
                (self.space.to_natural(beside) - self.optimum) / (nearest - self.estimate)
            vector, near = self._climbed(self._within(self.optimum + (value - self.estimate) * path, value), near)
            self.points[value] = (self.top - self._height(vector), vector, near)
        return self.points[value][0]

    def _within(self, plain: np.ndarray, value: float) -> np.ndarray:
        """The vector (k,) next to these plain unknowns that is within the bounds and has the value."""
        for _ in plain:  # what a bound takes away, the others share
            plain = np.clip(plain, self.low, self.high)
            missing = value - float(self.direction @ plain)
            room = np.where(self.direction * missing > 0, self.high - plain, plain - self.low) > 0
            share = np.where(room, self.direction * _span(self.space) ** 2, 0.0)
            if not share @ self.direction > 0:
                break
            plain = plain + missing * share / (share @ self.direction)
        return self.space.from_natural(plain)

    def _height(self, vector: np.ndarray) -> float:
        """log10 L of the model itself: polynomials about one candidate and another do not agree to its digits."""
        return float(exact(self.judge, self.space.candidate(vector)).sum())

    def _climbed(self, start: np.ndarray, near: Near) -> tuple[np.ndarray, Near]:
        """The maximum next to `start` (k,) at its value; polynomials are quadrature anew where theirs end."""
        for _ in range(ROUNDS):
            problem, region = near
            if np.all((start >= region.lower) & (start <= region.upper)):
                start, _ = constrained_maximum(problem, region, start, self.direction, _TOLERANCE)
                cut = (region.lower > self.space.lower) & (start <= region.lower) \
                    | (region.upper < self.space.upper) & (start >= region.upper)
                if not np.any(cut):
                    return start, near
            near = local_problem(self.problem, self.space, start)
        raise _NotFollowed


def _span(space: Unknowns) -> np.ndarray:
    """The range of each unknown, stds as they are, shape (k,)."""
    span: np.ndarray = space.to_natural(space.upper) - space.to_natural(space.lower)
    return span
