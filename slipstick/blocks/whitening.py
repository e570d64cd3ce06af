"""The noise of a block, and the filter that turns its columns into independent ones of unit variance.

A block predicts its output from measured inputs. The residual y contains the sensor noise v of the output and, where
the block integrates a noisy input, the integrated noise x of that input:

    y_t = x_t + v_t,   x_{t+1} = decay_t x_t + onto_t u_t,   x_0 = 0,   v and u stationary, first-order autoregressive

The filter is that of `engine.whitening`, with one output and a scalar state. It is linear, so that it is applied to
residuals and to the columns of a linear model alike.

What is known of an input may also be uncertain along some modes, functions of time that add to y with independent
standard normal weights. With the whitened modes M as rows, whitened rows have the covariance 1 + M'M, and multiplied by
the inverse of its symmetric root they are independent again.
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from slipstick.engine.noise import Noise
from slipstick.engine.whitening import CarriedNoise, Whitening


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
    n, _, k = columns.shape
    if noise.modes is not None:
        alone = replace(noise, modes=None)
        white, modes = whitened(columns, counted, alone), whitened(noise.modes[:, :, :k], counted, alone)
        _remove_modes(white, modes, _share_of(modes))
        return white
    plain = Whitening.of(counted[:, None], [Noise(noise.std, noise.correlation)], np.ones((n, 1)))
    if noise.decay is None or noise.onto is None:
        return plain.apply(columns[:, :, None])
    carried = CarriedNoise((Noise(noise.input_std, noise.input_correlation),), np.ones((n, 1)),
                           noise.decay[:, :, None, None], noise.onto[:, :, None, None],
                           np.zeros((*noise.onto.shape, 1, 1)), np.ones((n, 1, k, 1)), np.zeros((n, 1, k, 1)))
    gains, roots = np.zeros((n, k, 1, 3)), np.zeros((n, k, 1))
    _find_gains(plain.counted[:, 0], noise.std, noise.correlation, noise.input_std, noise.input_correlation,
                np.ascontiguousarray(noise.decay), np.ascontiguousarray(noise.onto), gains, roots)
    return replace(plain, carried=carried, gains=gains, roots=roots).apply(columns[:, :, None])


@njit(nogil=True, cache=True, error_model="numpy")
def _find_gains(counted, std, rho, input_std, input_rho, decay, onto, gains, roots):  # type: ignore[no-untyped-def]
    """Fill the gains of the filter, without the products with zeros that matrices of a scalar state would have."""
    # Variances of what is new in v and u at each sample.
    fresh, input_fresh = std * std * (1 - rho * rho), input_std * input_std * (1 - input_rho * input_rho)
    n, k = counted.shape
    for i in range(n):
        pxx, pxu, pxv, puu, puv, pvv = 0.0, 0.0, 0.0, input_std * input_std, 0.0, std * std
        for t in range(k):
            if counted[i, t]:
                # Covariances of the states with the sample, and its variance.
                cx, cu, cv = pxx + pxv, pxu + puv, pxv + pvv
                variance = cx + cv
                gx, gu, gv = cx / variance, cu / variance, cv / variance
                gains[i, t, 0, 0], gains[i, t, 0, 1], gains[i, t, 0, 2] = gx, gu, gv
                roots[i, t, 0] = 1 / np.sqrt(variance)
                pxx -= gx * cx
                pxu -= gx * cu
                pxv -= gx * cv
                puu -= gu * cu
                puv -= gu * cv
                pvv -= gv * cv
            if t + 1 < k:
                a, b = decay[i, t], onto[i, t]
                onward = a * pxu + b * puu
                pxx, pxu, pxv = a * (a * pxx + b * pxu) + b * onward, input_rho * onward, rho * (a * pxv + b * puv)
                puu, puv = input_rho * input_rho * puu + input_fresh, input_rho * rho * puv
            pvv = rho * rho * pvv + fresh


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
