"""Profile-likelihood intervals, and the combinations of the unknowns that the recordings identify.

The profile likelihood of an unknown, or of a weighted sum of unknowns, is the maximum of the log likelihood over all
other unknowns as a function of its value. The interval ends where the profile has dropped by half a chi-square quantile
(Wilks 1938). If the drop at a bound of the search is smaller, the interval is open at that end: the recordings do not
determine it.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy

from slipstick.uncertainty.fit.refine import (
    AGREEMENT,
    ROUNDS,
    constrained_maximum,
    information,
    local_problem,
    log10_likelihood,
    natural_scores,
    single_input_starts,
)
from slipstick.uncertainty.likelihood.problem import InferenceProblem
from slipstick.uncertainty.likelihood.unknowns import Unknowns

_SOLVES = 12  # largest number of iterations of the root finder for an end
_CLOSE = 0.03  # tolerance of the drop at an end, relative to the drop
_TOLERANCE = 1e-3  # tolerance of the optimizer at each value of a profile, in decades
_RENEWALS = 2  # largest number of new lattices for one value of a profile
_BRANCHES = 3  # largest number of times that the search for an end goes on from a higher maximum
_RUNS = 2
"""Runs of the optimizer from a start on that is far from a maximum: the first is scaled there, and may end early."""
_JUMP = 0.3  # error of the drop at an end, relative to the drop, above which the optimizer has failed at some value
_NEXT, _FURTHEST = 1.2, 3.0  # smallest step factor while an end is bracketed; above the largest, the bound is tried
_STEEPEST = 16.0  # limit of the drop relative to that at an end, so that distant values do not mislead the root finder
IDENTIFIED = 0.25
"""Largest standard error of an identified combination, in units of the ranges of the unknowns."""
Local = tuple[InferenceProblem, Unknowns]
"""A problem for the optimizer, and the search space in which it is valid (`refine.local_problem`)."""


@dataclass(frozen=True, eq=False)
class Interval:
    """An interval with the profile `curve` (p, 2), value and drop in decades, and the `unknowns` (p, k) at its points.

    An end is None if it is open or was not found. `unsettled` contains the ends that were not found, "lower" or
    "upper"; the curve then ends where the optimizer failed. `highest` is the vector (k,) with the smallest drop on the
    curve. That drop is negative if the estimate was not the maximum.
    """

    estimate: float
    lower: float | None
    upper: float | None
    unsettled: tuple[str, ...]
    level: float
    curve: np.ndarray
    unknowns: np.ndarray
    highest: np.ndarray


@dataclass(frozen=True, eq=False)
class Combination:
    """A unit vector `weights` (k,) in the unknowns in units of their ranges, and the standard error along it."""

    weights: np.ndarray
    std_error: float
    identified: bool


def profile_interval(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray, direction: np.ndarray,
                     level: float) -> Interval:
    """The profile-likelihood interval of direction (k,) . natural around the maximum `optimum` (k,).

    natural are the unknowns on natural scale.
    """
    profile = _Profile(problem, space, optimum, direction)
    drop, ends, unsettled = drop_at_level(level), [], []
    for name, side in (("lower", -1), ("upper", 1)):
        try:
            ends.append(profile.end(side, drop))
        except _ProfileError:
            ends.append(None)
            unsettled.append(name)
    curve = np.array([[value, profile.points[value][0]] for value in sorted(profile.points)])
    unknowns = np.array([space.to_natural(profile.points[value][1]) for value in sorted(profile.points)])
    _, highest, _ = min(profile.points.values(), key=lambda point: point[0])
    return Interval(profile.estimate, ends[0], ends[1], tuple(unsettled), level, curve, unknowns, highest)


def profile_drop(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray, direction: np.ndarray,
                 value: float) -> float:
    """Drop of the profile in decades from the maximum `optimum` (k,) to where direction (k,) . natural is `value`."""
    return _Profile(problem, space, optimum, direction).drop(value)


def combinations(problem: InferenceProblem, space: Unknowns, optimum: np.ndarray) -> list[Combination]:
    """Orthogonal combinations, the best identified first: the eigenvectors of the empirical information matrix."""
    values, vectors = np.linalg.eigh(information(natural_scores(problem, space, optimum)[1] * _span(space)))
    errors = 1 / np.sqrt(np.maximum(values - 1, 1e-12))  # without the prior, which `information` adds
    return [Combination(vector * np.sign(vector[np.argmax(np.abs(vector))]), float(error), bool(error < IDENTIFIED))
            for vector, error in zip(vectors.T[::-1], errors[::-1], strict=True)]


def direction_of(space: Unknowns, weights: np.ndarray) -> np.ndarray:
    """The direction (k,) in natural unknowns for `weights` (k,) of unknowns in units of their ranges."""
    return np.asarray(weights / _span(space))


def drop_at_level(level: float) -> float:
    """Drop of the profile in decades at the ends of an interval of confidence `level`."""
    return float(scipy.stats.chi2.ppf(level, 1) / 2 / np.log(10.0))


def widest_identified_interval(level: float) -> float:
    """Largest width of the interval of an identified combination, for the standard error `IDENTIFIED`."""
    return float(2 * np.sqrt(scipy.stats.chi2.ppf(level, 1)) * IDENTIFIED)


class _ProfileError(Exception):
    """The optimizer or the root finder failed before an end of the interval was reached."""


class _Profile:
    """The profile likelihood as a function of direction . natural.

    `points` maps each known value to its drop in decades, its vector (k,), and the local problem of the optimizer. An
    optimization at a new value starts from the nearest known value.
    """

    def __init__(self, problem: InferenceProblem, space: Unknowns, optimum: np.ndarray, direction: np.ndarray) -> None:
        self.problem, self.space, self.direction = problem, space, direction
        local = local_problem(problem, space, optimum)
        self.reference = replace(problem, direction=local[0].direction)
        self.top, self.optimum = log10_likelihood(self.reference, space, optimum), space.to_natural(optimum)
        self.estimate = float(direction @ self.optimum)
        self.points: dict[float, tuple[float, np.ndarray, Local]] = {self.estimate: (0.0, optimum, local)}
        self.low, self.high = space.to_natural(space.lower), space.to_natural(space.upper)
        scores = natural_scores(*local, optimum)[1] * _span(space)
        covariance = np.linalg.inv(information(scores)) * np.outer(_span(space), _span(space))
        self.variance = float(direction @ covariance @ direction)
        self.path = covariance @ direction / self.variance  # slope of the unknowns along the profile, if it is normal

    def end(self, side: int, drop_at_end: float) -> float | None:
        """The value below (`side` -1) or above (1) the estimate with a drop of `drop_at_end` decades; None if open.

        For a table, the search goes on if a maximum with the scatter in another input is higher at this value.
        """
        value = self._end_beyond(self.estimate, side, drop_at_end)
        for _ in range(_BRANCHES):
            if value is None or self.problem.knots is None or not self._is_raised(value, side, drop_at_end):
                break
            value = self._end_beyond(value, side, drop_at_end)
        return value

    def _is_raised(self, value: float, side: int, drop_at_end: float) -> bool:
        """Whether a start with the scatter in another input leads to a higher maximum at `value`, which is then kept.

        Values further out are then forgotten, because their maxima may be surpassed as well.
        """
        for start in list(single_input_starts(self.problem, self.space, self.points[value][1]))[:-1]:
            vector = self._feasible(self.space.to_natural(start), value)
            try:
                for _ in range(_RUNS):
                    vector, likelihood, local = self._maximum(vector, local_problem(self.problem, self.space, vector))
            except _ProfileError:
                continue
            if self.top - likelihood < self.points[value][0]:
                self.points[value] = (self.top - likelihood, vector, local)
        is_raised = self.points[value][0] < (1 - _CLOSE) * drop_at_end
        if is_raised:
            self.points = {known: point for known, point in self.points.items() if side * (known - value) <= 0}
        return is_raised

    def _end_beyond(self, inside: float, side: int, drop_at_end: float) -> float | None:
        """As `end`, from a value `inside` the interval, along the maxima near those of the values before."""
        edges = np.sort([self.direction * self.low, self.direction * self.high], axis=0).sum(axis=1)
        low, high = float(edges[0]), float(edges[1])

        def excess(value: float) -> float:  # in the square root of the drop, which is nearly linear in the value
            drop = self.drop(value)
            if abs(drop - drop_at_end) < _CLOSE * drop_at_end:
                return 0.0
            return float(np.sqrt(np.clip(drop, 0.0, _STEEPEST * drop_at_end)) - np.sqrt(drop_at_end))

        step = inside - self.estimate
        if step == 0:
            step = side * float(np.sqrt(2 * np.log(10.0) * drop_at_end * self.variance))
        while (surplus := excess(value := float(np.clip(self.estimate + step, low, high)))) < 0:
            if value in (low, high):
                return None
            factor = np.sqrt(drop_at_end) / max(np.sqrt(drop_at_end) + surplus, 1e-9)
            inside, step = value, step * max(factor, _NEXT) if factor < _FURTHEST else side * np.inf
        if surplus == 0:
            return value if self.drop(value) > drop_at_end or value not in (low, high) else None
        root, outcome = scipy.optimize.brentq(excess, inside, value, xtol=1e-3 * abs(value - inside), maxiter=_SOLVES,
                               full_output=True, disp=False)
        if not outcome.converged or abs(self.drop(float(root)) - drop_at_end) > _JUMP * drop_at_end:
            raise _ProfileError
        return float(root)

    def drop(self, value: float) -> float:
        """Drop of the profile in decades from the estimate to `value`."""
        if value not in self.points:
            nearest = min(self.points, key=lambda known: abs(known - value))
            _, neighbour, local = self.points[nearest]
            path = self.path if nearest == self.estimate else \
                (self.space.to_natural(neighbour) - self.optimum) / (nearest - self.estimate)
            start = self._feasible(self.optimum + (value - self.estimate) * path, value)
            vector, likelihood, local = self._maximum(start, local)
            self.points[value] = (self.top - likelihood, vector, local)
        return self.points[value][0]

    def _feasible(self, natural: np.ndarray, value: float) -> np.ndarray:
        """A vector (k,) near these natural unknowns that is within the bounds and has the value of the profile."""
        for _ in natural:  # unknowns that are not at a bound compensate for those that are clipped
            natural = np.clip(natural, self.low, self.high)
            missing = value - float(self.direction @ natural)
            has_room = np.where(self.direction * missing > 0, self.high - natural, natural - self.low) > 0
            move = np.where(has_room, self.direction * _span(self.space) ** 2, 0.0)
            if not move @ self.direction > 0:
                break
            natural = natural + missing * move / (move @ self.direction)
        return self.space.from_natural(natural)

    def _maximum(self, start: np.ndarray, local: Local) -> tuple[np.ndarray, float, Local]:
        """The constrained maximum near `start` (k,), and its log10 likelihood by the model itself.

        A local expansion is renewed if the maximum is at its edge, and a lattice if its sum has not converged there;
        if the new one has not either, lines replace it.
        """
        renewed = 0
        for _ in range(ROUNDS):
            problem, region = local
            if np.all((start >= region.lower) & (start <= region.upper)):
                start, likelihood = constrained_maximum(problem, region, start, self.direction, _TOLERANCE)
                is_cut = (region.lower > self.space.lower) & (start <= region.lower) \
                    | (region.upper < self.space.upper) & (start >= region.upper)
                if not np.any(is_cut):
                    reference = log10_likelihood(self.reference, self.space, start)
                    if problem.lattice is None or abs(likelihood - reference) < AGREEMENT:
                        return start, reference, local
                    renewed += 1
            problem, region = local_problem(self.problem, self.space, start)
            local = (problem if renewed <= _RENEWALS else replace(problem, lattice=None)), region
        raise _ProfileError


def _span(space: Unknowns) -> np.ndarray:
    """The range of each unknown on natural scale, shape (k,)."""
    return np.asarray(space.to_natural(space.upper) - space.to_natural(space.lower))
