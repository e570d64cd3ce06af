"""The scalar equation x' = f(t) - rate x, exact for f linear between samples."""

import numpy as np
from numba import njit

_SERIES = 1e-3
"""Product of rate and step below which the weights are taken from their Taylor series: its truncation and the
cancellation of the closed form are both below 1e-12 there."""


def relaxed(time: np.ndarray, forcing: np.ndarray, rate: np.ndarray, start: np.ndarray,
            least: float = -np.inf) -> np.ndarray:
    """x (n, k) at `time` (k,) for `forcing` (n, k), `rate` (n,) and `start` (n,), kept at `least` or above."""
    steps = np.diff(time)
    # Mostly all rates are the same: exponentials of a single one take a third of the time of the prediction.
    different = rate if np.any(rate != rate[0]) else rate[:1]
    decay, before, after = _weights(different[:, None] * steps)
    drive = steps * (before * forcing[:, :-1] + after * forcing[:, 1:])
    x = np.empty(forcing.shape)
    x[:, 0] = start
    _recur(x, np.broadcast_to(decay, drive.shape).copy(), drive, least)  # for what is read-only, it is compiled again
    return x


@njit(nogil=True, cache=True)
def _recur(x, decay, drive, least):  # type: ignore[no-untyped-def]
    for i in range(len(x)):
        for k in range(drive.shape[1]):
            x[i, k + 1] = max(least, decay[i, k] * x[i, k] + drive[i, k])


def _weights(y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """exp(-y), and the weights of the forcing at both ends of a step: integrals of exp(-y (1 - s)) (1 - s) and s."""
    safe = np.where(y > _SERIES, y, 1.0)
    decay = np.exp(-y)
    whole = np.where(y > _SERIES, -np.expm1(-safe) / safe, 1 - y / 2 + y**2 / 6 - y**3 / 24)
    after = np.where(y > _SERIES, (1 - whole) / safe, 1 / 2 - y / 6 + y**2 / 24 - y**3 / 120)
    return decay, whole - after, after
