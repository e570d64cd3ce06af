"""The noise of a block, and the filter that turns its columns into independent ones of unit variance.

A block predicts its output from measured inputs. The residual y contains the sensor noise v of the output and, where
the block integrates a noisy input, the integrated noise x of that input:

    y_t = x_t + v_t,   x_{t+1} = decay_t x_t + onto_t u_t,   x_0 = 0,   v and u stationary, first-order autoregressive

The innovations of the Kalman filter of this system, divided by their standard deviations, are independent with unit
variance: products of whitened columns are products under the inverse covariance of y (Durbin and Koopman, Time Series
Analysis by State Space Methods, section 4.3). The filter is linear, so that it is applied to residuals and to the
columns of a linear model alike.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit


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


def whitened(columns: np.ndarray, counted: np.ndarray, noise: BlockNoise) -> np.ndarray:
    """Columns (n, p, k) after the filter, without unit: 0 at samples that are not `counted` (n, k).

    Samples that are not counted are missing, not zero: the noise goes on over them.
    """
    n, p, k = columns.shape
    driven = noise.decay is not None and noise.onto is not None
    if noise.correlation == 0 and not driven:  # the samples are independent already
        return columns * (counted / noise.std)[:, None]
    out = np.zeros((n, p, k))
    still = np.zeros((n, 0))  # not read
    # Contiguous copies, so that the filter is compiled for one memory layout.
    decay, onto = (np.ascontiguousarray(one) if driven else still for one in (noise.decay, noise.onto))
    _filter(np.ascontiguousarray(columns), np.ascontiguousarray(counted), noise.std, noise.correlation,
            noise.input_std, noise.input_correlation, driven, decay, onto, out)
    return out


@njit(nogil=True, cache=True, error_model="numpy")
def _filter(columns, counted, std, rho, input_std, input_rho, driven, decay, onto, out):  # type: ignore[no-untyped-def]
    n, p, k = columns.shape
    # Variances of what is new in v and u at each sample.
    fresh, input_fresh = std * std * (1 - rho * rho), input_std * input_std * (1 - input_rho * input_rho)
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
            if driven and t + 1 < last:
                a, b = decay[i, t], onto[i, t]
                onward = a * pxu + b * puu
                pxx, pxu, pxv = a * (a * pxx + b * pxu) + b * onward, input_rho * onward, rho * (a * pxv + b * puv)
                puu, puv = input_rho * input_rho * puu + input_fresh, input_rho * rho * puv
            pvv = rho * rho * pvv + fresh
        for j in range(p):
            x, u, v = 0.0, 0.0, 0.0
            for t in range(last):
                innovation = columns[i, j, t] - x - v
                out[i, j, t] = innovation * gain[t, 3]
                v = rho * (v + gain[t, 2] * innovation)
                if driven and t + 1 < last:
                    u += gain[t, 1] * innovation
                    x = decay[i, t] * (x + gain[t, 0] * innovation) + onto[i, t] * u
                    u *= input_rho
