"""First-order lags that change within an engagement: what a signal trails by, with a lag at each sample."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from slipstick.naming.block import Pair
from slipstick.naming.scene import WITHIN

CONSTANT: dict[str, Pair] = {"friction lag": ("contact pressure", "lag"), "converter lag": ("converter torque", "lag")}
"""Quantities of blocks that are such a lag, and the pair of the same lag where it is constant: both are one effect."""
OVER = (*WITHIN, "run order", "motor speed")
"""What such a lag may depend on."""
_LEAST = 1e-3
"""Lag in samples below which nothing is left of a change."""


def trailing(signal: np.ndarray, lag: np.ndarray, step: float) -> np.ndarray:
    """The change (n, k) of a `signal` (n, k), sampled every `step` s, that follows it with a `lag` (n, k) in s."""
    return Trail.of(lag, step).change(signal)


def with_constant_lag(pair: Pair) -> Pair:
    """The pair of the same effect with a constant lag, or the pair itself where it is no lag that changes."""
    return CONSTANT.get(pair[0], pair)


@dataclass(frozen=True, eq=False)
class Trail:
    """A lag of some samples, `ratio` (n, k), and what is `left` (n, k) of a change after each sample.

    In steady state at the first sample, and exact for a signal that is linear between samples with a constant lag. A
    negative lag is a lead by it on a ramp, of a sample at most: the change is linear in the lag about 0, so that a fit
    can begin there, and no fit can go far beyond.
    """

    step: float
    ratio: np.ndarray
    left: np.ndarray

    @classmethod
    def of(cls, lag: np.ndarray, step: float) -> "Trail":
        """That of a `lag` (n, k) in s of signals that are sampled every `step` s."""
        ratio = np.maximum(lag / step, -1.0)
        return cls(step, ratio, np.exp(-1 / np.maximum(ratio, _LEAST)))

    def change(self, signal: np.ndarray) -> np.ndarray:
        """The change (n, k) of a `signal` (n, k) that follows it with the lag."""
        changes = np.empty(signal.shape)
        _trail(np.ascontiguousarray(signal), self.ratio, self.left, changes)
        return changes

    def columns(self, signal: np.ndarray, basis: np.ndarray) -> np.ndarray:
        """Derivatives (n, m, k) of the change with the coefficients of a further lag, with `basis` (n, m, k) in s."""
        columns = np.empty(basis.shape)
        _columns(np.ascontiguousarray(signal), self.ratio, self.left, self.change(signal),
                 np.ascontiguousarray(basis / self.step), columns)
        return columns


@njit(nogil=True, cache=True, error_model="numpy")
def _trail(signal, ratio, left, changes):  # type: ignore[no-untyped-def]
    n, k = signal.shape
    for i in range(n):
        change = 0.0
        changes[i, 0] = change
        for t in range(1, k):
            change = left[i, t] * change + ratio[i, t] * (1 - left[i, t]) * (signal[i, t - 1] - signal[i, t])
            changes[i, t] = change


@njit(nogil=True, cache=True, error_model="numpy")
def _columns(signal, ratio, left, change, basis, columns):  # type: ignore[no-untyped-def]
    n, m, k = basis.shape
    slope = np.zeros(k)
    for i in range(n):
        for t in range(1, k):
            # Derivatives with the ratio r of exp(-1 / r), and of r (1 - exp(-1 / r)): 0 and 1 where r is negative.
            per = 1 / ratio[i, t] if left[i, t] > 0 else 0.0
            slope[t] = left[i, t] * per * per * change[i, t - 1] + (1 - left[i, t] * (1 + per)) * (
                signal[i, t - 1] - signal[i, t]) if ratio[i, t] > -1 else 0.0
        for j in range(m):
            column = 0.0
            columns[i, j, 0] = column
            for t in range(1, k):
                column = left[i, t] * column + slope[t] * basis[i, j, t]
                columns[i, j, t] = column
