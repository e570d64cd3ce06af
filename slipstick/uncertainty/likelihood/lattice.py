"""The likelihood of one or two inputs by sums over lattices of standard normals, refined until two sums agree.

    p = integral of phi(u) N(t; y(u), s^2) du  ~  |cell| times the sum over the lattice of phi(u) N(t; y(u), s^2)

The error of such a sum (the trapezoid rule) falls exponentially with the step for a smooth integrand, and with its
square at the kinks of a table. Each refinement adds the centres of the cells, which doubles the number of points and
keeps the sums over the earlier ones. The larger one of the changes of the result by the last two refinements is the
error estimate: a single change may be small by chance, above all beside the edge of a table.

As a function of u, the density of a time is a ridge across the direction in which the time changes. A lattice whose
rows are parallel to the ridge resolves it worst. The rows are therefore turned by 22.5 degrees from the direction in
which the times of all conditions change most; a refinement turns them by 45 degrees, and thus preserves this angle.
Ridges that are too narrow for a lattice are left to the lines with breakpoints at the knots (lines.py).

An optimizer keeps the lattice of its start, because a change of the lattice would make the sum discontinuous. The
expansions of a search are smooth, and are summed over a single lattice whose step follows from the narrowest ridge.
"""

import math
from collections.abc import Iterator

import numba
import numpy as np

from slipstick.uncertainty.likelihood.exponential import exponential
from slipstick.uncertainty.likelihood.lines import Moments
from slipstick.uncertainty.likelihood.problem import Candidate, InferenceProblem, Lattice
from slipstick.wide_vectors import WideCompiler

_TURN = math.pi / 8
_COARSEST = 0.8  # step of the first lattice in stds
_PER_WIDTH = 2.0  # step of the first lattice relative to the width of the median ridge
_BEFORE = math.sqrt(2)  # step before that, from which a first change is known
MOST = 1 << 15
"""Default largest number of points."""
_FEWEST_TERMS = 8.0  # smallest sum of a condition in units of its largest term: sums of fewer terms may agree by chance
_BLOCK = 1024  # points per call of the model; their times remain in the cache of a core
_RADIUS = 5.0  # radius of the disc of points in stds, to which the distance of the measured times is added
_SUFFICIENT = 1.2  # step relative to the width of a ridge at which the relative error of a sum across it is 2e-6
_SUFFICIENT_RADIUS = 4.5  # radius in stds beyond the distance of a measured time; outside is less than 1e-5 of it
_MARGIN = 3.5  # smallest distance in stds of the largest term of a condition from the edge of the disc
_LEAST = 1e-7
"""Smallest term that an optimizer's sum keeps, relative to the largest one of a condition: 1,000 smaller ones change a
sum of `_FEWEST_TERMS` of the largest by 1e-5. Of 1,800 points, 1e-6, 1e-8 and 1e-10 keep 1,200, 1,500 and 1,600."""
_LN10 = math.log(10.0)


def summed(problem: InferenceProblem, candidate: Candidate, slopes: np.ndarray, direction: np.ndarray,
           distance: float, box: np.ndarray, tolerance: float,
           most: int = MOST) -> tuple[np.ndarray, float, Lattice] | None:
    """log10 p per ms (n,), its estimated error, and the lattice.

    The error is the larger one of the last two changes, each summed over the conditions, in decades.

    `slopes` (d, n) are the derivatives of the times in s with respect to the standard normals, which are largest along
    `direction` (d,); `distance` is the largest distance of a measured time from its mean in stds, and `box` (d, 2) are
    the normal scores beyond which there are no points. None if the error is not below `tolerance` with `most` points,
    or if a measured time may be beyond the disc of points.
    """
    radius = _RADIUS + distance
    step = _BEFORE * min(_COARSEST, _PER_WIDTH * float(np.median(_widths(slopes, candidate.output_std))))
    before, last, parts, sums = None, math.inf, [], _Sums(problem, 1)
    for normals, size in _refinements(direction, step, radius, most):
        sums.add(candidate, normals, box)
        parts.append(normals)
        density = sums.density(candidate.output_std, size, len(direction))
        change = math.inf if before is None else _change(before, density)
        error, last, before = max(change, last), change, density
        if error < tolerance and np.min(sums.rows[0]) > _FEWEST_TERMS:
            is_covered = np.max(sums.squares) < (radius - _MARGIN) ** 2
            return (density, error, Lattice(np.concatenate(parts), size)) if is_covered else None
    return None


def trimmed(problem: InferenceProblem, candidate: Candidate, lattice: Lattice, box: np.ndarray) -> Lattice:
    """The lattice without the points whose terms are negligible for all conditions of a candidate."""
    scores, normals, distances = _inside(lattice.normals, candidate.inputs.factor, box)
    times = problem.model(candidate.inputs.at_scores(scores), problem.conditions)
    beyond = _beyond(np.ascontiguousarray(times), problem.measured_time, candidate.output_std, distances)
    return Lattice(normals[beyond < -2 * math.log(_LEAST)], lattice.size)


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


def sufficient(slopes: np.ndarray, direction: np.ndarray, noise: float, distance: float, most: int) -> Lattice | None:
    """A lattice whose error is below 1e-5 decades per condition for a linear model; arguments as for `summed`.

    None if it has more than about `most` points, because the noise is narrow or a measured time is far.
    """
    step = min(_COARSEST, _SUFFICIENT * float(np.min(_widths(slopes, noise))))
    return next((Lattice(*first) for first in _refinements(direction, step, _SUFFICIENT_RADIUS + distance, most)), None)


def log10_density(lattice: Lattice, times: np.ndarray, measured: np.ndarray, noise: float) -> np.ndarray:
    """log10 p per ms (n,) from the times (m, n) of a model at the points of a lattice."""
    n, (m, d) = len(measured), lattice.normals.shape
    peaks, squares, rows = np.full(n, -np.inf), np.zeros(n), np.zeros((1, n))
    _add(times, measured, noise, np.sum(lattice.normals**2, axis=1), np.empty((m, 0)), peaks, squares, rows)
    return _density(peaks, rows[0], noise, lattice.size, d)


def _widths(slopes: np.ndarray, noise: float) -> np.ndarray:
    """The widths of the ridges in stds, shape (n,)."""
    widths: np.ndarray = noise / np.sqrt(noise**2 + np.sum(slopes**2, axis=0))
    return widths


def _density(peaks: np.ndarray, sums: np.ndarray, noise: float, size: float, dimension: int) -> np.ndarray:
    """log10 p per ms (n,) of sums in units of exp(`peaks`), for cells of this size."""
    unit = noise * (2 * math.pi) ** ((dimension + 1) / 2)
    with np.errstate(divide="ignore"):
        density: np.ndarray = (peaks + np.log(sums * (size / unit))) / _LN10 - 3.0
    return density


class _Sums:
    """Sums (r, n) over points, in units of exp(`peaks`) (n,); `squares` (n,) are |u|^2 of the largest terms.

    The rows are the density, half the squared residual in units of the noise, u and the upper triangle of u u^T, or the
    density alone.
    """

    def __init__(self, problem: InferenceProblem, rows: int) -> None:
        n = len(problem.measured_time)
        self.problem, self.rows = problem, np.zeros((rows, n))
        self.peaks, self.squares = np.full(n, -np.inf), np.zeros(n)

    def add(self, candidate: Candidate, normals: np.ndarray, box: np.ndarray) -> None:
        """Add the points u (m, d) inside the box."""
        scores, normals, distances = _inside(normals, candidate.inputs.factor, box)
        monomials = _monomials(normals) if len(self.rows) > 1 else np.empty((len(normals), 0))
        for first in range(0, len(scores), _BLOCK):
            block = slice(first, first + _BLOCK)
            times = self.problem.model(candidate.inputs.at_scores(scores[block]), self.problem.conditions)
            _add(np.ascontiguousarray(times), self.problem.measured_time, candidate.output_std, distances[block],
                 monomials[block], self.peaks, self.squares, self.rows)

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


def _refinements(direction: np.ndarray, step: float, radius: float,
                 most: int) -> Iterator[tuple[np.ndarray, float]]:
    """The points (m, d) of the first lattice and then those that each refinement adds, with the size of the cells.

    Ends where there would be more than about `most` points in total.
    """
    volume = 2 * radius if len(direction) == 1 else math.pi * radius**2
    if len(direction) == 1:
        cell, halved = np.array([[step]]), np.array([[0.5]])
    else:
        along, turn = np.array([[direction[0], -direction[1]], [direction[1], direction[0]]]), _TURN
        cell = step * along @ np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
        halved = np.array([[0.5, 0.5], [0.5, -0.5]])
    size, shift = step ** len(cell), np.zeros(len(cell))
    while volume / size <= most:
        yield _disc(cell, shift, radius), size
        if shift.any():
            cell = cell @ halved
        shift, size = cell.sum(axis=1) / 2, size / 2


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _disc(cell: np.ndarray, shift: np.ndarray, radius: float) -> np.ndarray:
    """The points shift + cell k with integers k that are at most `radius` from the origin: shape (m, d), d < 3."""
    d = len(shift)
    most = int(radius / math.sqrt(np.sum(cell[:, 0] ** 2))) + 1
    others = most if d == 2 else 0
    points, m = np.empty(((2 * most + 1) * (2 * others + 1), d)), 0
    for i in range(-most, most + 1):
        for j in range(-others, others + 1):
            square = 0.0
            for axis in range(d):
                points[m, axis] = shift[axis] + cell[axis, 0] * i + cell[axis, d - 1] * j
                square += points[m, axis] ** 2
            if square <= radius * radius:
                m += 1
    return points[:m]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _inside(normals: np.ndarray, factor: np.ndarray, box: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Those of the points u (m, d) whose scores `factor` u are inside the box: scores, points, and |u|^2."""
    d, m = normals.shape[1], 0
    scores, points, squares = np.empty(normals.shape), np.empty(normals.shape), np.empty(len(normals))
    for k in range(len(normals)):
        is_inside, squares[m] = True, 0.0
        for i in range(d):
            score = 0.0
            for j in range(d):
                score += factor[i, j] * normals[k, j]
            scores[m, i], points[m, i] = score, normals[k, i]
            squares[m] += normals[k, i] ** 2
            is_inside &= box[i, 0] <= score <= box[i, 1]
        if is_inside:
            m += 1
    return scores[:m], points[:m], squares[:m]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _beyond(times: np.ndarray, measured: np.ndarray, noise: float, distances: np.ndarray) -> np.ndarray:
    """-2 times the logarithm of the largest ratio (m,) that a point's terms have to the largest of their conditions."""
    m, n = times.shape
    least, found = np.full(n, np.inf), np.full(m, np.inf)
    for k in range(m):
        for i in range(n):
            residual = (measured[i] - times[k, i]) / noise
            term = distances[k] + residual * residual
            least[i] = term if term < least[i] else least[i]  # false for NaN
    for k in range(m):
        for i in range(n):
            residual = (measured[i] - times[k, i]) / noise
            beyond = distances[k] + residual * residual - least[i]
            if beyond < found[k]:
                found[k] = beyond
    return found


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, pipeline_class=WideCompiler)
def _add(times: np.ndarray, measured: np.ndarray, noise: float, distances: np.ndarray, monomials: np.ndarray,
         peaks: np.ndarray, squares: np.ndarray, sums: np.ndarray) -> None:
    """Add the terms exp(-(|u|^2 + ((t - y) / s)^2) / 2) of the points to `sums` (see `_Sums`).

    `distances` (m,) are |u|^2. A term for which the time is NaN is negligible.
    """
    scale, before = math.sqrt(0.5) / noise, peaks.copy()
    _raise_peaks(times, measured, scale, distances, peaks, squares)
    for i in range(len(peaks)):
        factor = math.exp(before[i] - peaks[i]) if before[i] < peaks[i] else 1.0
        for row in range(sums.shape[0]):
            sums[row, i] *= factor
    if sums.shape[0] == 1:
        _add_terms(times, measured, scale, distances, peaks, sums[0])
    else:
        _add_moments(times, measured, scale, distances, monomials, peaks, sums)


# Factors of a point are read before the loop over the conditions: LLVM makes vector instructions of it only then.


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, pipeline_class=WideCompiler)
def _raise_peaks(times: np.ndarray, measured: np.ndarray, scale: float, distances: np.ndarray, peaks: np.ndarray,
                 squares: np.ndarray) -> None:
    for k in range(times.shape[0]):
        distance = distances[k]
        for i in range(times.shape[1]):
            residual = scale * (measured[i] - times[k, i])
            term = -0.5 * distance - residual * residual
            is_larger = term > peaks[i]  # false for NaN
            peaks[i] = term if is_larger else peaks[i]
            squares[i] = distance if is_larger else squares[i]


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, pipeline_class=WideCompiler)
def _add_terms(times: np.ndarray, measured: np.ndarray, scale: float, distances: np.ndarray, peaks: np.ndarray,
               total: np.ndarray) -> None:
    for k in range(times.shape[0]):
        exponent = -0.5 * distances[k]
        for i in range(times.shape[1]):
            residual = scale * (measured[i] - times[k, i])
            square = residual * residual
            term = exponential(exponent - square - peaks[i])
            total[i] += term if square >= 0.0 else 0.0  # 0 for NaN


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, pipeline_class=WideCompiler)
def _add_moments(times: np.ndarray, measured: np.ndarray, scale: float, distances: np.ndarray, monomials: np.ndarray,
                 peaks: np.ndarray, sums: np.ndarray) -> None:
    n = len(peaks)
    terms, halves = np.empty(n), np.empty(n)
    for k in range(times.shape[0]):
        exponent = -0.5 * distances[k]
        for i in range(n):
            residual = scale * (measured[i] - times[k, i])
            square = residual * residual
            term = exponential(exponent - square - peaks[i])
            terms[i], halves[i] = (term, term * square) if square >= 0.0 else (0.0, 0.0)  # 0 for NaN
        for i in range(n):
            sums[0, i] += terms[i]
            sums[1, i] += halves[i]
        for column in range(monomials.shape[1]):
            factor = monomials[k, column]
            for i in range(n):
                sums[2 + column, i] += factor * terms[i]
