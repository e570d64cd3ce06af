"""The density of a measured time, integrated along lines through the space of the standard normals.

    p = sum over lines j of w_j * integral of phi(z) N(t; y_j(z), s^2) dz

On the piece between two breakpoints of a line, y is linear, y = a + b z, and the integrand is proportional to a normal
density in z:

    phi(z) N(t; a + b z, s^2) = N(t; a, s^2 + b^2) N(z; m, v),   m = b (t - a)/(s^2 + b^2),   v = s^2/(s^2 + b^2)

Each piece therefore has a closed form, which is evaluated in logarithms for any noise s and any time t. With
breakpoints at the knots of a table, the result is the exact integral of the interpolated table along the line.
"""

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from slipstick.uncertainty.likelihood.pieces import LANES, sum_derivatives, sum_pieces

_LN10 = np.log(10.0)
_LOG_TWO_PI = math.log(2 * math.pi)
_FEWEST = 1 << 18  # smallest number of pieces, over all conditions, per thread: some milliseconds


@dataclass(frozen=True, eq=False)
class Lines:
    """m lines of g breakpoints each in the space of d standard normals u = (z, across).

    Along a line, z increases over the `breakpoints` (m, g), and the other components of u are constant, `across`
    (m, d - 1). The normal scores of the inputs are `factor` u. `log_weight` (m,) are the log weights of the rule across
    the lines; they do not contain the normal density of z.
    """

    breakpoints: np.ndarray
    across: np.ndarray
    log_weight: np.ndarray
    factor: np.ndarray

    @property
    def scores(self) -> np.ndarray:
        """Normal scores of the inputs at all breakpoints, line by line: shape (m g, d)."""
        m, g = self.breakpoints.shape
        scores: np.ndarray = (self.breakpoints[:, :, None] * self.factor[:, 0]
                              + (np.einsum("mj,ij->mi", self.across, self.factor[:, 1:]))[:, None, :])
        return scores.reshape(m * g, len(self.factor))


@dataclass(frozen=True, eq=False)
class Moments:
    """Conditional moments of u and of the residual, given the measured times of n conditions.

    `first` (n, d) is E[u], `second` (n, d, d) is E[u u^T], and `residual` (n,) is the mean squared residual in s^2. By
    Fisher's identity these determine the gradient of the likelihood. They are NaN where the density is 0.
    """

    first: np.ndarray
    second: np.ndarray
    residual: np.ndarray


def log10_density(lines: Lines, outputs: np.ndarray, times: np.ndarray, output_std: float) -> np.ndarray:
    """log10 p per ms, shape (n,), from outputs (m g, n) in s at the breakpoints of the lines; -inf if all are NaN.

    A piece with a NaN at either end has a density of 0.
    """
    return _integrate(lines, outputs, times, output_std, 1)[0]


def density_and_moments(lines: Lines, outputs: np.ndarray, times: np.ndarray,
                        output_std: float) -> tuple[np.ndarray, Moments]:
    """As `log10_density`, with the conditional moments that determine the gradient."""
    d, n = len(lines.factor), len(times)
    log_density, _, sums = _integrate(lines, outputs, times, output_std, 2 + d + d * (d + 1) // 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        moments = sums[:, 1:] / sums[:, :1]
    second, (rows, columns) = np.empty((n, d, d)), np.triu_indices(d)
    second[:, rows, columns] = second[:, columns, rows] = moments[:, 1 + d:]
    return log_density, Moments(moments[:, 1:1 + d], second, moments[:, 0])


def density_and_derivatives(lines: Lines, outputs: np.ndarray, times: np.ndarray,
                            output_std: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `log10_density`, with the derivatives of ln p.

    The derivatives are with respect to each output, shape (m g, n) in 1/s, and with respect to the logarithm of the
    output std, shape (n,). They are 0 where the density is 0.
    """
    log_density, top, sums = _integrate(lines, outputs, times, output_std, 1)
    values = np.ascontiguousarray(outputs).reshape(*lines.breakpoints.shape, len(times))
    derivatives, residual = np.zeros(values.shape), np.zeros(len(times))
    per_density = np.divide(1.0, sums[:, 0], out=np.zeros(len(times)), where=sums[:, 0] > 0)
    _run_in_threads(lines.breakpoints.size, len(times), lambda first, last: sum_derivatives(
        values, lines.breakpoints, lines.log_weight, times, output_std, first, last, top, per_density,
        derivatives, residual))
    by_noise = np.where(per_density > 0, residual / output_std**2 - 1.0, 0.0)
    return log_density, derivatives.reshape(outputs.shape), by_noise


def _integrate(lines: Lines, outputs: np.ndarray, times: np.ndarray, output_std: float,
               columns: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """log10 p per ms (n,), and the sums (n, columns) of `sum_pieces` with their units, exp(top) (n,)."""
    n = len(times)
    values = np.ascontiguousarray(outputs).reshape(*lines.breakpoints.shape, n)
    top, sums = np.full(n, -np.inf), np.zeros((n, columns))
    _run_in_threads(lines.breakpoints.size, n, lambda first, last: sum_pieces(
        values, lines.breakpoints, lines.log_weight, lines.across, times, output_std, first, last, top, sums))
    with np.errstate(divide="ignore"):
        return (top + np.log(sums[:, 0]) - _LOG_TWO_PI - math.log(output_std)) / _LN10 - 3.0, top, sums


def _run_in_threads(pieces: int, count: int, work: Callable[[int, int], None]) -> None:
    """Call `work(first, last)` on consecutive ranges of `count` conditions, in threads if that takes milliseconds."""
    blocks, most = -(-count // LANES), pieces * count // _FEWEST
    threads = min(os.cpu_count() or 1, blocks, most) if most > 1 else 1
    if threads == 1:
        work(0, count)
        return
    edges = np.minimum(np.linspace(0, blocks, threads + 1).astype(int) * LANES, count)
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, edges[:-1], edges[1:]))
