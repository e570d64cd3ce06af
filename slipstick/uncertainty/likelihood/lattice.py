"""The likelihood of one or two inputs by sums over lattices of standard normals, refined until two sums agree.

    p = integral of phi(u) N(t; y(u), s^2) du  ~  |cell| times the sum over the lattice of phi(u) N(t; y(u), s^2)

The error of such a sum (the trapezoid rule) falls exponentially with the step for a smooth integrand, and with its
square at the kinks of a table. Each refinement adds the centres of the cells, which doubles the number of points and
keeps the sums over the earlier ones. The larger one of the changes of the result by the last two refinements is the
error estimate: a single change may be small by chance, above all beside the edge of a table.

As a function of u, the density of a time is a ridge across the direction in which the time changes. Ridges that are too
narrow for a lattice are left to the lines with breakpoints at the knots (lines.py).

An optimizer keeps the lattice of its start, because a change of the lattice would make the sum discontinuous. The
expansions of a search are smooth, and are summed over a single lattice whose step follows from the narrowest ridge.
"""

import math

import numpy as np

from slipstick.uncertainty.likelihood.lattice_points import axes_of, inside, refinements
from slipstick.uncertainty.likelihood.lattice_terms import add, beyond
from slipstick.uncertainty.likelihood.lines import Moments
from slipstick.uncertainty.likelihood.problem import Candidate, InferenceProblem, Lattice

_COARSEST = 0.8  # step of the first lattice in stds
_PER_WIDTH = 2.0  # step of the first lattice relative to the width of the median ridge
_BEFORE = math.sqrt(2)  # step before that, from which a first change is known
MOST = 1 << 16
"""Default largest number of points."""
_FEWEST_TERMS = 8.0  # smallest sum of a condition in units of its largest term: sums of fewer terms may agree by chance
_BLOCK = 1024  # points per call of the model; their times remain in the cache of a core
_BESIDE = 5.0  # stds by which the points go beyond the most likely normals of all conditions
_SUFFICIENT = 1.2  # step relative to the width of a ridge at which the relative error of a sum across it is 2e-6
_SUFFICIENT_BESIDE = 4.5  # the same in stds where less than 1e-5 may be outside
_MARGIN = 3.5  # smallest distance in stds of the largest term of a condition from the edges
_LEAST = 1e-7
"""Smallest term that an optimizer's sum keeps, relative to the largest one of a condition: 1,000 smaller ones change a
sum of `_FEWEST_TERMS` of the largest by 1e-5. Of 1,800 points, 1e-6, 1e-8 and 1e-10 keep 1,200, 1,500 and 1,600."""
_LN10 = math.log(10.0)


def sum_to_tolerance(problem: InferenceProblem, candidate: Candidate, slopes: np.ndarray, direction: np.ndarray,
                     expected: np.ndarray, box: np.ndarray, tolerance: float,
                     most: int = MOST) -> tuple[np.ndarray, float, Lattice] | None:
    """log10 p per ms (n,), its estimated error, and the lattice.

    The error is the larger one of the last two changes, each summed over the conditions, in decades.

    `slopes` (d, n) are the derivatives of the times in s with respect to the standard normals, which are largest along
    `direction` (d,); `expected` (d, n) are the normals that a linear model expects for each measured time, and `box`
    (d, 2) are the normal scores beyond which there are no points. None if the error is not below `tolerance` with
    `most` points, or if the density of a measured time may be beyond the points.
    """
    edges = _edges(direction, expected, _BESIDE)
    widths = np.median(_widths(slopes, direction, candidate.output_std), axis=1)
    step = _BEFORE * np.minimum(_COARSEST, _PER_WIDTH * widths)
    before, last, parts, sums = None, math.inf, [], _Sums(problem, 1)
    for normals, size in refinements(direction, step, edges, most):
        sums.add(candidate, normals, box)
        parts.append(normals)
        density = sums.density(candidate.output_std, size, len(direction))
        change = math.inf if before is None else _change(before, density)
        error, last, before = max(change, last), change, density
        if error < tolerance and np.min(sums.rows[0]) > _FEWEST_TERMS:
            at = sums.largest @ axes_of(direction)
            is_covered = np.all((at > edges[:, 0] + _MARGIN) & (at < edges[:, 1] - _MARGIN))
            return (density, error, Lattice(np.concatenate(parts), size)) if is_covered else None
    return None


def trim(problem: InferenceProblem, candidate: Candidate, lattice: Lattice, box: np.ndarray) -> Lattice:
    """The lattice without the points whose terms are negligible for all conditions of a candidate."""
    scores, normals, distances = inside(lattice.normals, candidate.inputs.factor, box)
    times = problem.model(candidate.inputs.at_scores(scores), problem.conditions)
    above = beyond(np.ascontiguousarray(times), problem.measured_time, candidate.output_std, distances)
    return Lattice(normals[above < -2 * math.log(_LEAST)], lattice.size)


def density_and_moments(problem: InferenceProblem, candidate: Candidate, lattice: Lattice,
                        box: np.ndarray) -> tuple[np.ndarray, Moments]:
    """log10 p per ms (n,) on a given lattice, and the conditional moments of u (see `Moments`)."""
    d, n = candidate.inputs.dimension, len(problem.measured_time)
    rows, columns = np.triu_indices(d)
    sums = _Sums(problem, 2 + d + len(rows))
    sums.add(candidate, lattice.normals, box)
    with np.errstate(invalid="ignore", divide="ignore"):
        moments = sums.rows[1:] / sums.rows[0]
    second = np.empty((n, d, d))
    second[:, rows, columns] = second[:, columns, rows] = moments[1 + d:].T
    return (sums.density(candidate.output_std, lattice.size, d),
            Moments(moments[1:1 + d].T, second, 2 * candidate.output_std**2 * moments[0]))


def sufficient_lattice(slopes: np.ndarray, direction: np.ndarray, noise: float, expected: np.ndarray,
                       most: int) -> Lattice | None:
    """A lattice whose error is below 1e-5 decades per condition for a linear model.

    Its arguments are as for `sum_to_tolerance`. None if it has more than about `most` points, because the noise is
    narrow or a measured time is far.
    """
    step = np.minimum(_COARSEST, _SUFFICIENT * np.min(_widths(slopes, direction, noise), axis=1))
    edges = _edges(direction, expected, _SUFFICIENT_BESIDE)
    return next((Lattice(*first) for first in refinements(direction, step, edges, most)), None)


def log10_density(lattice: Lattice, times: np.ndarray, measured: np.ndarray, noise: float) -> np.ndarray:
    """log10 p per ms (n,) from the times (m, n) of a model at the points of a lattice."""
    n, (m, d) = len(measured), lattice.normals.shape
    peaks, rows = np.full(n, -np.inf), np.zeros((1, n))
    add(times, measured, noise, np.sum(lattice.normals**2, axis=1), np.empty((m, 0)), peaks, np.empty(n), rows)
    return _density(peaks, rows[0], noise, lattice.size, d)


def _edges(direction: np.ndarray, expected: np.ndarray, beside: float) -> np.ndarray:
    """The least and largest coordinates (d, 2) of points along the axes, which go `beside` stds beyond the expected."""
    along = axes_of(direction).T @ expected
    return np.column_stack([along.min(axis=1) - beside, along.max(axis=1) + beside])


def _widths(slopes: np.ndarray, direction: np.ndarray, noise: float) -> np.ndarray:
    """The std (d, n) of u along `direction` and across it, given the time of each condition, for slopes (d, n)."""
    squares = np.array([(direction @ slopes) ** 2])
    if len(direction) == 2:
        squares = np.concatenate([squares, np.sum(slopes**2, axis=0) - squares])
    return np.asarray(np.sqrt(1 - squares / (noise**2 + np.sum(slopes**2, axis=0))))


def _density(peaks: np.ndarray, sums: np.ndarray, noise: float, size: float, dimension: int) -> np.ndarray:
    """log10 p per ms (n,) of sums in units of exp(`peaks`), for cells of this size."""
    unit = noise * (2 * math.pi) ** ((dimension + 1) / 2)
    with np.errstate(divide="ignore"):
        density: np.ndarray = (peaks + np.log(sums * (size / unit))) / _LN10 - 3.0
    return density


class _Sums:
    """Sums (r, n) over points, in units of exp(`peaks`) (n,); `largest` (n, d) are the points of the largest terms.

    The rows are the density, half the squared residual in units of the noise, u and the upper triangle of u u^T, or the
    density alone.
    """

    def __init__(self, problem: InferenceProblem, rows: int) -> None:
        n = len(problem.measured_time)
        self.problem, self.rows = problem, np.zeros((rows, n))
        self.peaks, self.largest = np.full(n, -np.inf), np.zeros((n, len(problem.axes)))

    def add(self, candidate: Candidate, normals: np.ndarray, box: np.ndarray) -> None:
        """Add the points u (m, d) inside the box."""
        scores, normals, distances = inside(normals, candidate.inputs.factor, box)
        monomials = _monomials(normals) if len(self.rows) > 1 else np.empty((len(normals), 0))
        for first in range(0, len(scores), _BLOCK):
            block = slice(first, first + _BLOCK)
            times = self.problem.model(candidate.inputs.at_scores(scores[block]), self.problem.conditions)
            numbers = np.full(len(self.peaks), -1.0)
            add(np.ascontiguousarray(times), self.problem.measured_time, candidate.output_std, distances[block],
                monomials[block], self.peaks, numbers, self.rows)
            is_new = numbers >= 0
            self.largest[is_new] = normals[block][numbers[is_new].astype(int)]

    def density(self, noise: float, size: float, dimension: int) -> np.ndarray:
        """log10 p per ms (n,) for cells of this size."""
        return _density(self.peaks, self.rows[0], noise, size, dimension)


def _monomials(normals: np.ndarray) -> np.ndarray:
    """u and the upper triangle of u u^T at the points u (m, d), side by side."""
    rows, columns = np.triu_indices(normals.shape[1])
    return np.concatenate([normals, normals[:, rows] * normals[:, columns]], axis=1)


def _change(before: np.ndarray, after: np.ndarray) -> float:
    """Sum of the absolute changes; that of a density of 0 which remains 0 is 0."""
    with np.errstate(invalid="ignore"):
        return float(np.sum(np.abs(np.where(after == before, 0.0, after - before))))
