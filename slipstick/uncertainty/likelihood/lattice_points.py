"""The points of lattices of standard normals, and their refinements.

As a function of the standard normals, the density of a time is a ridge across the direction in which the time changes.
For two inputs, the rows of a lattice are along the direction in which the times of all conditions change most, with a
step of its own along and across it: a ridge needs many points across it, and few along it. Each row is shifted against
the next one by an irrational share of the step, so that no two have their points at the same places across the ridges.
"""

import math
from collections.abc import Iterator

import numba
import numpy as np

_SHEAR = math.sqrt(2) - 1
"""Shift of a row against the next one, as a share of the step."""


def axes_of(direction: np.ndarray) -> np.ndarray:
    """The axes of a lattice, columns (d, d): the `direction` (d,) and the one across it."""
    return direction[:, None] if len(direction) == 1 else np.array([[direction[0], -direction[1]],
                                                                    [direction[1], direction[0]]])


def refinements(direction: np.ndarray, steps: np.ndarray, edges: np.ndarray,
                most: int) -> Iterator[tuple[np.ndarray, float]]:
    """The points (m, d) of the first lattice and then those that each refinement adds, with the size of the cells.

    `steps` (d,) are those along the axes of `direction`, and `edges` (d, 2) the least and largest coordinates. Ends
    where there would be more than about `most` points in total.
    """
    cell = np.diag(steps)
    cell[0, 1:] = _SHEAR * steps[0]
    halved = np.array([[0.5]]) if len(steps) == 1 else np.array([[0.5, 0.5], [0.5, -0.5]])
    volume, size, shift = float(np.prod(edges[:, 1] - edges[:, 0])), float(np.prod(steps)), np.zeros(len(cell))
    while volume / size <= most:
        yield _rectangle(cell, np.linalg.inv(cell), shift, edges) @ axes_of(direction).T, size
        if shift.any():
            cell = cell @ halved
        shift, size = cell.sum(axis=1) / 2, size / 2


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _rectangle(cell: np.ndarray, inverse: np.ndarray, shift: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """The points shift + cell k with integers k that are within the edges (d, 2): shape (m, d), d < 3."""
    d = len(shift)
    first, last = np.zeros(2, np.int64), np.zeros(2, np.int64)
    for axis in range(d):
        low = high = 0.0
        for other in range(d):
            ends = inverse[axis, other] * (edges[other] - shift[other])
            low, high = low + min(ends[0], ends[1]), high + max(ends[0], ends[1])
        first[axis], last[axis] = math.floor(low), math.ceil(high)
    points, m = np.empty(((last[0] - first[0] + 1) * (last[1] - first[1] + 1), d)), 0
    for i in range(first[0], last[0] + 1):
        for j in range(first[1], last[1] + 1):
            is_inside = True
            for axis in range(d):
                points[m, axis] = shift[axis] + cell[axis, 0] * i + (cell[axis, 1] * j if d == 2 else 0.0)
                is_inside &= edges[axis, 0] <= points[m, axis] <= edges[axis, 1]
            if is_inside:
                m += 1
    return points[:m]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def inside(normals: np.ndarray, factor: np.ndarray, box: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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
