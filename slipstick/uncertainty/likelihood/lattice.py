"""The likelihood of one or two inputs by sums over lattices of standard normals, refined until two sums agree.

    p = integral of phi(u) N(t; y(u), s^2) du  ~  |cell| times the sum over the lattice of phi(u) N(t; y(u), s^2)

The error of such a sum (the trapezoid rule) falls exponentially with the step for a smooth integrand, and with its
square at the kinks of a table. Each refinement adds the centres of the cells, which doubles the number of points and
keeps the sums over the earlier ones. The change of the result by the last refinement is the error estimate; it is
dominated by the error of the coarser lattice.

As a function of u, the density of a time is a ridge across the direction in which the time changes. A lattice whose
rows are parallel to the ridge resolves it worst. The rows are therefore turned by 22.5 degrees from the direction in
which the times of all conditions change most; a refinement turns them by 45 degrees, and thus preserves this angle.
Ridges that are too narrow for a lattice are left to the lines with breakpoints at the knots (lines.py).
"""

import math
from collections.abc import Iterator

import numba
import numpy as np

from slipstick.uncertainty.likelihood.problem import Candidate, InferenceProblem

_TURN = math.pi / 8
_COARSEST = 0.8  # step of the first lattice in stds
_PER_WIDTH = 2.0  # step of the first lattice relative to the width of the median ridge
_MOST = 1 << 15  # largest number of points
_FEWEST_TERMS = 8.0  # smallest sum of a condition in units of its largest term: sums of fewer terms may agree by chance
_BLOCK = 512  # points per call of the model; their times remain in the cache of a core
_RADIUS = 5.0  # radius of the disc of points in stds, to which the distance of the measured times is added
_MARGIN = 3.5  # smallest distance in stds of the largest term of a condition from the edge of the disc
_NEGLIGIBLE = 64.0  # natural log below the largest term at which a term is rounded up
_LN10 = math.log(10.0)


def summed(problem: InferenceProblem, candidate: Candidate, slopes: np.ndarray, direction: np.ndarray,
           distance: float, box: np.ndarray, tolerance: float) -> tuple[np.ndarray, float] | None:
    """log10 p per ms (n,), and its estimated error: the sum over the conditions of the last changes, in decades.

    `slopes` (d, n) are the derivatives of the times in s with respect to the standard normals, which are largest along
    `direction` (d,); `distance` is the largest distance of a measured time from its mean in stds, and `box` (d, 2) are
    the normal scores beyond which there are no points. None if the error is not below `tolerance` with `_MOST` points,
    or if a measured time may be beyond the disc of points.
    """
    noise, radius = candidate.output_std, _RADIUS + distance
    width = float(np.median(noise / np.sqrt(noise**2 + np.sum(slopes**2, axis=0))))
    unit = noise * (2 * math.pi) ** ((len(direction) + 1) / 2)  # of the sums, for cells of size 1
    n, before = len(problem.measured_time), None
    peaks, squares, sums = np.full(n, -np.inf), np.zeros(n), np.zeros(n)
    for normals, size in _refinements(direction, min(_COARSEST, _PER_WIDTH * width), radius):
        scores = normals @ candidate.inputs.factor.T
        inside = np.all((scores >= box[:, 0]) & (scores <= box[:, 1]), axis=1)
        scores, distances = scores[inside], np.sum(normals[inside] ** 2, axis=1)
        for first in range(0, len(scores), _BLOCK):
            block = slice(first, first + _BLOCK)
            times = problem.model(candidate.inputs.at_scores(scores[block]), problem.conditions)
            _add(np.ascontiguousarray(times), problem.measured_time, noise, distances[block], peaks, squares, sums)
        with np.errstate(divide="ignore"):
            density = (peaks + np.log(sums * (size / unit))) / _LN10 - 3.0
        error = math.inf if before is None else _change(before, density)
        if error < tolerance and np.min(sums) > _FEWEST_TERMS:
            return (density, error) if np.max(squares) < (radius - _MARGIN) ** 2 else None
        before = density
    return None


def _change(before: np.ndarray, after: np.ndarray) -> float:
    """Sum of the absolute changes; that of a density of 0 which remains 0 is 0."""
    with np.errstate(invalid="ignore"):
        return float(np.sum(np.abs(np.where(after == before, 0.0, after - before))))


def _refinements(direction: np.ndarray, step: float, radius: float) -> Iterator[tuple[np.ndarray, float]]:
    """The points (m, d) of the first lattice and then those that each refinement adds, with the size of the cells.

    Ends where there would be more than about `_MOST` points in total.
    """
    volume = 2 * radius if len(direction) == 1 else math.pi * radius**2
    if len(direction) == 1:
        cell, halved = np.array([[step]]), np.array([[0.5]])
    else:
        along, turn = np.array([[direction[0], -direction[1]], [direction[1], direction[0]]]), _TURN
        cell = step * along @ np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
        halved = np.array([[0.5, 0.5], [0.5, -0.5]])
    size, shift = step ** len(cell), np.zeros(len(cell))
    while volume / size <= _MOST:
        yield _disc(cell, shift, radius), size
        if shift.any():
            cell = cell @ halved
        shift, size = cell.sum(axis=1) / 2, size / 2


def _disc(cell: np.ndarray, shift: np.ndarray, radius: float) -> np.ndarray:
    """The points shift + cell k with integers k that are at most `radius` from the origin: shape (m, d)."""
    most = int(radius / np.linalg.norm(cell[:, 0])) + 1
    reach = np.arange(-most, most + 1)
    integers = np.stack(np.meshgrid(*[reach] * len(cell), indexing="ij"), axis=-1).reshape(-1, len(cell))
    points = shift + integers @ cell.T
    disc: np.ndarray = points[np.sum(points**2, axis=1) <= radius**2]
    return disc


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _add(times: np.ndarray, measured: np.ndarray, noise: float, distances: np.ndarray, peaks: np.ndarray,
         squares: np.ndarray, sums: np.ndarray) -> None:
    """Add the terms exp(-(|u|^2 + ((t - y) / s)^2) / 2) of the points to `sums`, which are in units of exp(`peaks`).

    `distances` (m,) are |u|^2, and `squares` (n,) those of the largest term of each condition. A term for which the
    time is NaN is negligible. The loops over the conditions are compiled to vector instructions, in which math.exp has
    no place: exp(x) is the Taylor polynomial of x / 512, squared nine times, with a relative error below 1e-9.
    """
    m, n = times.shape
    scale = math.sqrt(0.5) / noise
    earlier = peaks.copy()
    for k in range(m):
        for i in range(n):
            residual = scale * (measured[i] - times[k, i])
            term = -0.5 * distances[k] - residual * residual
            is_larger = term > peaks[i]  # false for NaN
            peaks[i] = term if is_larger else peaks[i]
            squares[i] = distances[k] if is_larger else squares[i]
    for i in range(n):
        if sums[i] > 0.0:
            sums[i] *= math.exp(earlier[i] - peaks[i])
    for k in range(m):
        for i in range(n):
            residual = scale * (measured[i] - times[k, i])
            term = -0.5 * distances[k] - residual * residual - peaks[i]
            x = (term if term > -_NEGLIGIBLE else -_NEGLIGIBLE) * (1 / 512)
            p = 1 + x * (1 + x * (1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720 + x * (1 / 5040)))))))
            p *= p
            p *= p
            p *= p
            p *= p
            p *= p
            p *= p
            p *= p
            p *= p
            p *= p
            sums[i] += p
