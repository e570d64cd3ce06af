"""The noise of a block, and the filter that turns its columns into independent ones of unit variance.

A block predicts its output from measured inputs. The residual y contains the sensor noise v of the output and, where
the block integrates a noisy input, the integrated noise x of that input:

    y_t = x_t + v_t,   x_{t+1} = decay_t x_t + onto_t u_t,   x_0 = 0,   v and u stationary, first-order autoregressive

The innovations of its Kalman filter, divided by their standard deviations, are independent with unit variance: products
of whitened columns are products under the inverse covariance of y (Durbin and Koopman, Time Series Analysis by State
Space Methods, section 4.3). The filter is linear, so that it is applied to residuals and to the columns of a linear
model alike.

What is known of an input may also be uncertain along some modes, functions of time that add to y with independent
standard normal weights. With the whitened modes M as rows, whitened rows have the covariance 1 + M'M, and multiplied by
the inverse of its symmetric root they are independent again.
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

_LANES = 8
"""Columns that are filtered at a time: each step waits for the one before, and those of other columns do not."""


@dataclass(frozen=True, eq=False)
class BlockNoise:
    """Sensor noise of the output: `std` in its unit, and `correlation` from sample to sample.

    Where the block integrates an input, `input_std` and `input_correlation` are those of the input's sensor. `decay`
    and `onto` (n, k - 1) propagate its noise over each step: `decay` has no unit, `onto` is that of the output over
    that of the input. Without `decay` and `onto` nothing is integrated.
    """

    std: float
    correlation: float
    input_std: float = 0.0
    input_correlation: float = 0.0
    decay: np.ndarray | None = None
    onto: np.ndarray | None = None
    modes: np.ndarray | None = None

    def of(self, rows: slice | np.ndarray) -> "BlockNoise":
        """The noise of some of the n engagements."""
        of_each = {name: values[rows] for name in ("decay", "onto", "modes")
                   if (values := getattr(self, name)) is not None}
        return replace(self, **of_each)


def whitened(columns: np.ndarray, counted: np.ndarray, noise: BlockNoise) -> np.ndarray:
    """Columns (n, p, k) after the filter, without unit: 0 at samples that are not `counted` (n, k).

    Samples that are not counted are missing, not zero: the noise goes on over them.
    """
    n, p, k = columns.shape
    if noise.modes is not None:
        plain = replace(noise, modes=None)
        white, modes = whitened(columns, counted, plain), whitened(noise.modes[:, :, :k], counted, plain)
        _remove_modes(white, modes, _share_of(modes))
        return white
    if noise.correlation == 0 and noise.decay is None:  # the samples are independent already
        return columns * (counted / noise.std)[:, None]
    out = np.zeros((n, p, k))
    # Contiguous copies, so that the filters are compiled for one memory layout.
    columns, counted = np.ascontiguousarray(columns), np.ascontiguousarray(counted)
    if noise.decay is None or noise.onto is None:
        _whiten_autoregressive(columns, counted, noise.std, noise.correlation, out)
    else:
        _filter(columns, counted, noise.std, noise.correlation, noise.input_std, noise.input_correlation,
                np.ascontiguousarray(noise.decay), np.ascontiguousarray(noise.onto), out)
    return out


@njit(nogil=True, cache=True, error_model="numpy")
def _whiten_autoregressive(columns, counted, std, rho, out):  # type: ignore[no-untyped-def]
    """The filter without integrated noise: the noise of the sensor is known at every sample that is counted."""
    n, p, k = columns.shape
    following = 1 / (std * np.sqrt(1 - rho * rho))
    for i in range(n):
        start, last, known = 0, 0, 0.0  # `known` is the share of the noise at the `last` counted sample that is left
        while start < k:
            if not counted[i, start]:
                known *= rho
                start += 1
                continue
            end = start + 1
            while end < k and counted[i, end]:
                end += 1
            weight = 1 / (std * np.sqrt(1 - known * known))
            for j in range(p):
                out[i, j, start] = (columns[i, j, start] - known * columns[i, j, last]) * weight
                for t in range(start + 1, end):
                    out[i, j, t] = (columns[i, j, t] - rho * columns[i, j, t - 1]) * following
            start, last, known = end, end - 1, rho


def _share_of(modes: np.ndarray) -> np.ndarray:
    """The matrices S (n, r, r) of modes M (n, r, k) for which 1 - M'SM is the inverse root of 1 + M'M."""
    size, axes = np.linalg.eigh(modes @ modes.transpose(0, 2, 1))
    root = np.sqrt(1 + np.maximum(size, 0.0))
    return np.asarray((axes / (root * (1 + root))[:, None]) @ axes.transpose(0, 2, 1))


@njit(nogil=True, cache=True, error_model="numpy", fastmath={"reassoc", "contract"})
def _remove_modes(white, modes, share):  # type: ignore[no-untyped-def]
    """Take their `share` (n, r, r) of `modes` (n, r, k) off rows `white` (n, p, k), which are of unit variance then."""
    n, p, k = white.shape
    r = modes.shape[1]
    onto = np.zeros(r)
    for i in range(n):
        for j in range(p):
            for a in range(r):
                total = 0.0
                for t in range(k):
                    total += white[i, j, t] * modes[i, a, t]
                onto[a] = total
            for a in range(r):
                weight = 0.0
                for b in range(r):
                    weight += share[i, a, b] * onto[b]
                for t in range(k):
                    white[i, j, t] -= weight * modes[i, a, t]


@njit(nogil=True, cache=True, error_model="numpy")
def _filter(columns, counted, std, rho, input_std, input_rho, decay, onto, out):  # type: ignore[no-untyped-def]
    n, p, k = columns.shape
    # Variances of what is new in v and u at each sample.
    fresh, input_fresh = std * std * (1 - rho * rho), input_std * input_std * (1 - input_rho * input_rho)
    x, u, v, innovation = np.zeros(_LANES), np.zeros(_LANES), np.zeros(_LANES), np.zeros(_LANES)
    for i in range(n):
        # The gains are those of all columns; where a sample is not counted, they are 0.
        last = k
        while last > 0 and not counted[i, last - 1]:
            last -= 1
        gain = np.zeros((last, 4))
        pxx, pxu, pxv, puu, puv, pvv = 0.0, 0.0, 0.0, input_std * input_std, 0.0, std * std
        for t in range(last):
            if counted[i, t]:
                # Covariances of the states with the sample, and its variance.
                cx, cu, cv = pxx + pxv, pxu + puv, pxv + pvv
                variance = cx + cv
                gx, gu, gv = cx / variance, cu / variance, cv / variance
                gain[t, 0], gain[t, 1], gain[t, 2], gain[t, 3] = gx, gu, gv, 1 / np.sqrt(variance)
                pxx -= gx * cx
                pxu -= gx * cu
                pxv -= gx * cv
                puu -= gu * cu
                puv -= gu * cv
                pvv -= gv * cv
            if t + 1 < last:
                a, b = decay[i, t], onto[i, t]
                onward = a * pxu + b * puu
                pxx, pxu, pxv = a * (a * pxx + b * pxu) + b * onward, input_rho * onward, rho * (a * pxv + b * puv)
                puu, puv = input_rho * input_rho * puu + input_fresh, input_rho * rho * puv
            pvv = rho * rho * pvv + fresh
        for first in range(0, p, _LANES):
            lanes = min(_LANES, p - first)
            x[:] = 0.0
            u[:] = 0.0
            v[:] = 0.0
            for t in range(last):
                for j in range(lanes):
                    innovation[j] = columns[i, first + j, t] - x[j] - v[j]
                for j in range(lanes):
                    out[i, first + j, t] = innovation[j] * gain[t, 3]
                gx, gu, gv = gain[t, 0], gain[t, 1], gain[t, 2]
                for j in range(_LANES):
                    v[j] = rho * (v[j] + gv * innovation[j])
                if t + 1 < last:
                    a, b = decay[i, t], onto[i, t]
                    for j in range(_LANES):
                        u[j] += gu * innovation[j]
                        x[j] = a * (x[j] + gx * innovation[j]) + b * u[j]
                        u[j] *= input_rho
