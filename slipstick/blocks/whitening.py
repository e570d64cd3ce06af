"""The noise of a block, and the filter that turns its columns into independent ones of unit variance.

A block predicts its output from measured inputs. The residual y contains the sensor noise v of the output and, where
the block integrates a noisy input, the integrated noise x of that input:

    y_t = x_t + v_t,   x_{t+1} = decay_t x_t + onto_t u_t,   x_0 = 0,   v and u stationary, first-order autoregressive

What is known of an input may also be uncertain along some modes, functions of time that add to y with independent
standard normal weights: constant states of the same system. The innovations of its Kalman filter, divided by their
standard deviations, are independent with unit variance: products of whitened columns are products under the inverse
covariance of y (Durbin and Koopman, Time Series Analysis by State Space Methods, section 4.3). The filter is linear, so
that it is applied to residuals and to the columns of a linear model alike.
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

_LANES = 8
"""Columns that are filtered at a time: each step waits for the one before, and those of other columns do not."""


@dataclass(frozen=True, eq=False)
class ModeFilter:
    """The Kalman filter of the weights of some modes: `modes` (n, r, k) that are whitened as samples are.

    A weight gains `gain` (n, k, r) times the innovation of a sample, which has a standard deviation of 1 / `scale`
    (n, k).
    """

    modes: np.ndarray
    gain: np.ndarray
    scale: np.ndarray

    def of(self, rows: slice | np.ndarray, samples: int | None = None) -> "ModeFilter":
        """The filter of some engagements, and of the first `samples`."""
        return ModeFilter(*(np.ascontiguousarray(one) for one in (
            self.modes[rows, :, :samples], self.gain[rows, :samples], self.scale[rows, :samples])))


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
    filter: ModeFilter | None = None

    def of(self, rows: slice | np.ndarray) -> "BlockNoise":
        """The noise of some of the n engagements."""
        of_each = {name: values[rows] for name in ("decay", "onto", "modes")
                   if (values := getattr(self, name)) is not None}
        return replace(self, **of_each, filter=None if self.filter is None else self.filter.of(rows))

    def with_filter(self, counted: np.ndarray) -> "BlockNoise":
        """With the filter of its modes for samples that are `counted` (n, k), which depends on no column."""
        return self if self.modes is None else replace(self, filter=_filter_of(self.modes, counted, self))


def whitened(columns: np.ndarray, counted: np.ndarray, noise: BlockNoise) -> np.ndarray:
    """Columns (n, p, k) after the filter, without unit: 0 at samples that are not `counted` (n, k).

    Samples that are not counted are missing, not zero: the noise goes on over them.
    """
    n, p, k = columns.shape
    if noise.modes is not None:
        known = _filter_of(noise.modes[:, :, :k], counted, noise) if noise.filter is None else \
            noise.filter.of(slice(None), k)
        out = whitened(columns, counted, replace(noise, modes=None, filter=None))
        _without_modes(out, counted, known.modes, known.gain, known.scale)
        return out
    if noise.correlation == 0 and noise.decay is None:  # the samples are independent already
        return columns * (counted / noise.std)[:, None]
    out = np.zeros((n, p, k))
    # Contiguous copies, so that the filters are compiled for one memory layout.
    columns, counted = np.ascontiguousarray(columns), np.ascontiguousarray(counted)
    if noise.decay is None or noise.onto is None:
        _autoregressive(columns, counted, noise.std, noise.correlation, out)
    else:
        _filter(columns, counted, noise.std, noise.correlation, noise.input_std, noise.input_correlation,
                np.ascontiguousarray(noise.decay), np.ascontiguousarray(noise.onto), out)
    return out


@njit(nogil=True, cache=True, error_model="numpy")
def _autoregressive(columns, counted, std, rho, out):  # type: ignore[no-untyped-def]
    """The filter without integrated noise: the noise of the sensor is known at every sample that is counted."""
    n, p, k = columns.shape
    known, following = np.zeros(k), 1 / (std * np.sqrt(1 - rho * rho))
    for i in range(n):
        left = 0.0  # share of the noise at the last counted sample that is left
        for t in range(k):
            known[t] = left
            left = rho if counted[i, t] else rho * left
        for j in range(p):
            before = 0.0
            for t in range(k):
                if counted[i, t]:
                    weight = following if known[t] == rho else 1 / (std * np.sqrt(1 - known[t] * known[t]))
                    out[i, j, t] = (columns[i, j, t] - known[t] * before) * weight
                    before = columns[i, j, t]


def _filter_of(modes: np.ndarray, counted: np.ndarray, noise: BlockNoise) -> ModeFilter:
    n, r, k = modes.shape
    found = ModeFilter(whitened(modes, counted, replace(noise, modes=None, filter=None)), np.zeros((n, k, r)),
                       np.zeros((n, k)))
    _gains(counted, found.modes, found.gain, found.scale)
    return found


@njit(nogil=True, cache=True, error_model="numpy")
def _gains(counted, modes, gain, scale):  # type: ignore[no-untyped-def]
    n, r, k = modes.shape
    for i in range(n):
        covariance = np.eye(r)  # of the weights, given the samples so far
        for t in range(k):
            if counted[i, t]:
                variance = 1.0
                for a in range(r):
                    for b in range(r):
                        gain[i, t, a] += covariance[a, b] * modes[i, b, t]
                    variance += gain[i, t, a] * modes[i, a, t]
                for a in range(r):
                    for b in range(r):
                        covariance[a, b] -= gain[i, t, a] * gain[i, t, b] / variance
                for a in range(r):
                    gain[i, t, a] /= variance
                scale[i, t] = 1 / np.sqrt(variance)


@njit(nogil=True, cache=True, error_model="numpy")
def _without_modes(white, counted, modes, gain, scale):  # type: ignore[no-untyped-def]
    """Make rows of unit variance of `white` (n, p, k), in which `modes` (n, r, k) of unit variance are left."""
    n, p, k = white.shape
    r = modes.shape[1]
    weight, innovation = np.zeros((r, _LANES)), np.zeros(_LANES)
    for i in range(n):
        for first in range(0, p, _LANES):
            some = min(_LANES, p - first)
            weight[:] = 0.0
            for t in range(k):
                if counted[i, t]:
                    for j in range(some):
                        innovation[j] = white[i, first + j, t]
                    for a in range(r):
                        mode = modes[i, a, t]
                        for j in range(_LANES):
                            innovation[j] -= weight[a, j] * mode
                    for a in range(r):
                        share = gain[i, t, a]
                        for j in range(_LANES):
                            weight[a, j] += share * innovation[j]
                    for j in range(some):
                        white[i, first + j, t] = innovation[j] * scale[i, t]


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
            some = min(_LANES, p - first)
            x[:] = 0.0
            u[:] = 0.0
            v[:] = 0.0
            for t in range(last):
                for j in range(some):
                    innovation[j] = columns[i, first + j, t] - x[j] - v[j]
                for j in range(some):
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
