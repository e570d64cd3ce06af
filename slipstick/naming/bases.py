"""Bases of free laws: piecewise linear functions of what a law depends on."""

import numpy as np

from slipstick.clutch.lag import lagged_signal

KNOTS = 5
FINE = 9


def hats(x: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Hat functions (n, m, ...) of x (n, ...) at m knots, constant outside."""
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)


def from_zero(x: np.ndarray, seen: np.ndarray, count: int = FINE) -> np.ndarray:
    """Knots (m,) for a quantity with a natural zero, closer near it, over the values x where `seen`."""
    top = float(np.quantile(x[seen], 0.999)) if seen.any() else 1.0
    return max(top, 1e-9) * np.linspace(0, 1, count) ** 2


def evenly(x: np.ndarray, seen: np.ndarray, count: int = FINE) -> np.ndarray:
    """Knots (m,) evenly over the values x where `seen`."""
    low, high = (np.quantile(x[seen], [0.001, 0.999])) if seen.any() else (0.0, 1.0)
    return np.linspace(low, max(high, low + 1e-9), count)


def between(values: np.ndarray) -> np.ndarray:
    """Basis (n, m) over a quantity that is constant in a run, (n,): levels where there are few; each has mean 0."""
    levels = np.unique(values)
    knots = levels if len(levels) <= KNOTS else np.unique(np.quantile(values, np.linspace(0, 1, KNOTS - 1)))
    if len(knots) < 2:
        return np.zeros((len(values), 0))
    basis = hats(values, knots)[:, 1:]
    return basis - basis.mean(axis=0)


def sensor_basis(on, signal, time, scale):
    if on == "offset":
        return np.ones_like(signal)[:, None]
    if on == "gain":
        return np.stack([signal, signal * np.abs(signal) / np.abs(signal).max()], axis=1)
    return np.stack([lagged_signal(signal, time, np.full((1,), lag)) - signal for lag in scale * np.array([0.1, 0.3, 1.0, 3.0])], axis=1)


def late(signal: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Change (n, k) of the reading of a signal (n, k) for each second by which its clock is late."""
    change = np.zeros_like(signal)
    change[:, 1:] = -np.diff(signal, axis=1) / np.diff(time)
    return change
