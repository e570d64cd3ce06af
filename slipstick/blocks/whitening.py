"""The noise of a block, and the filter that turns its columns into independent ones of unit variance.

A block predicts its output from measured inputs. The residual y contains the sensor noise v of the output and, where
the block integrates a noisy input, the integrated noise x of that input:

    y_t = x_t + v_t,   x_{t+1} = decay_t x_t + onto_t u_t,   v and u first-order autoregressive

The innovations of the Kalman filter of this system, divided by their standard deviations, are independent with unit
variance; the filter is linear, so that it is applied to residuals and to the columns of a linear model alike.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit


@dataclass(frozen=True, eq=False)
class BlockNoise:
    """Sensor noise of the output, `std` and `correlation` from sample to sample, and the noise of the integrated input.

    `input_std` and `input_correlation` are those of the input; `decay` and `onto` (n, k - 1) propagate it.
    """

    std: float
    correlation: float
    input_std: float = 0.0
    input_correlation: float = 0.0
    decay: np.ndarray | None = None
    onto: np.ndarray | None = None


def whitened(columns: np.ndarray, counted: np.ndarray, noise: BlockNoise) -> np.ndarray:
    """Columns (n, p, k) after the filter: normalised innovations, 0 at samples that are not `counted` (n, k)."""
    n, p, k = columns.shape
    still = np.zeros((1, k - 1))
    decay = still if noise.decay is None else noise.decay
    onto = still if noise.onto is None else noise.onto
    out = np.zeros((n, p, k))
    _filter(np.ascontiguousarray(columns), counted, noise.std, noise.correlation, noise.input_std,
            noise.input_correlation, decay, onto, out)
    return out


@njit(nogil=True, cache=True, error_model="numpy")
def _filter(columns, counted, std, rho, input_std, input_rho, decay, onto, out):  # type: ignore[no-untyped-def]
    n, p, k = columns.shape
    driven = decay.shape[0] == n
    fresh, input_fresh = std * std * (1 - rho * rho), input_std * input_std * (1 - input_rho * input_rho)
    x, u, v = np.zeros(p), np.zeros(p), np.zeros(p)
    for i in range(n):
        x[:], u[:], v[:] = 0.0, 0.0, 0.0
        pxx, pxu, pxv, puu, puv, pvv = 0.0, 0.0, 0.0, input_std * input_std, 0.0, std * std
        for t in range(k):
            if counted[i, t]:
                cx, cu, cv = pxx + pxv, pxu + puv, pxv + pvv
                variance = cx + cv
                gx, gu, gv, scale = cx / variance, cu / variance, cv / variance, 1 / np.sqrt(variance)
                for j in range(p):
                    innovation = columns[i, j, t] - x[j] - v[j]
                    out[i, j, t] = innovation * scale
                    x[j] += gx * innovation
                    u[j] += gu * innovation
                    v[j] += gv * innovation
                pxx -= gx * cx
                pxu -= gx * cu
                pxv -= gx * cv
                puu -= gu * cu
                puv -= gu * cv
                pvv -= gv * cv
            if t + 1 == k:
                break
            if driven:
                a, b = decay[i, t], onto[i, t]
                for j in range(p):
                    x[j] = a * x[j] + b * u[j]
                    u[j] *= input_rho
                    v[j] *= rho
                pxx, pxu, pxv = a * (a * pxx + b * pxu) + b * (a * pxu + b * puu), input_rho * (a * pxu + b * puu), \
                    rho * (a * pxv + b * puv)
                puu, puv, pvv = input_rho * input_rho * puu + input_fresh, input_rho * rho * puv, rho * rho * pvv + fresh
            else:
                for j in range(p):
                    v[j] *= rho
                pvv = rho * rho * pvv + fresh
