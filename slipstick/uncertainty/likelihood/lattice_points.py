"""The points of lattices of standard normals, and their refinements.

As a function of the standard normals, the density of a time is a ridge across the direction in which the time changes.
A lattice whose rows are parallel to the ridge resolves it worst. The rows are therefore turned by 22.5 degrees from the
direction in which the times of all conditions change most; a refinement turns them by 45 degrees, and thus preserves
this angle.
"""

import math
from collections.abc import Iterator

import numba
import numpy as np

_TURN = math.pi / 8


def refinements(direction: np.ndarray, step: float, radius: float,
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
