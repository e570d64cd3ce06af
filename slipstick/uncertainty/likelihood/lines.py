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

import numba
import numpy as np

_LN10 = np.log(10.0)
_HALF_LOG_TWO_PI = 0.5 * math.log(2 * math.pi)
_ROOT_HALF = math.sqrt(0.5)
_NEGLIGIBLE = 32.0  # natural log below the current sum at which a piece contributes less than 1e-13 of it
_FEWEST = 64  # smallest number of conditions per thread


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
    log_density, sums = _integrate(lines, outputs, times, output_std, 2 + d + d * (d + 1) // 2)
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
    log_density = log10_density(lines, outputs, times, output_std)
    values = np.ascontiguousarray(outputs).reshape(*lines.breakpoints.shape, len(times))
    derivatives, residual = np.zeros(values.shape), np.zeros(len(times))
    ln_density = (log_density + 3.0) * _LN10
    _run_in_threads(len(times), lambda first, last: _sum_derivatives(
        values, lines.breakpoints, lines.log_weight, times, output_std, first, last, ln_density, derivatives, residual))
    by_noise = np.where(np.isfinite(ln_density), residual / output_std**2 - 1.0, 0.0)
    return log_density, derivatives.reshape(outputs.shape), by_noise


def _integrate(lines: Lines, outputs: np.ndarray, times: np.ndarray, output_std: float,
               columns: int) -> tuple[np.ndarray, np.ndarray]:
    n = len(times)
    values = np.ascontiguousarray(outputs).reshape(*lines.breakpoints.shape, n)
    top, sums = np.full(n, -np.inf), np.zeros((n, columns))
    _run_in_threads(n, lambda first, last: _sum_pieces(
        values, lines.breakpoints, lines.log_weight, lines.across, times, output_std, first, last, top, sums))
    with np.errstate(divide="ignore"):
        return (top + np.log(sums[:, 0])) / _LN10 - 3.0, sums


def _run_in_threads(count: int, work: Callable[[int, int], None]) -> None:
    """Call `work(first, last)` in threads, on consecutive ranges of the conditions."""
    threads = min(os.cpu_count() or 1, max(1, count // _FEWEST))
    edges = np.linspace(0, count, threads + 1).astype(int)
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, edges[:-1], edges[1:]))


@numba.njit(cache=True, nogil=True)
def _sum_pieces(values, breakpoints, log_weight, across, times, noise, first, last, top, sums):
    """Sum all pieces for the conditions from `first` up to `last`; `sums` are in units of exp(`top`).

    Columns of `sums`: density, squared residual, first moments and second moments of (z, across).
    """
    variance, log_noise = noise * noise, math.log(noise)
    others, moments = across.shape[1], sums.shape[1] > 1
    for line in range(values.shape[0]):
        base = log_weight[line] - _HALF_LOG_TWO_PI
        for piece in range(values.shape[1] - 1):
            low, high = breakpoints[line, piece], breakpoints[line, piece + 1]
            if not high > low:
                continue
            for i in range(first, last):
                log_piece, offset, slope, centre, width, lower, upper, log_mass = _piece(
                    values[line, piece, i], values[line, piece + 1, i], low, high, times[i], variance, log_noise,
                    base, top[i] - _NEGLIGIBLE)
                if log_piece == -np.inf:
                    continue
                if log_piece > top[i]:
                    factor = math.exp(top[i] - log_piece)
                    for column in range(sums.shape[1]):
                        sums[i, column] *= factor
                    top[i] = log_piece
                mass = math.exp(log_piece - top[i])
                sums[i, 0] += mass
                if moments:
                    mean, spread = _truncated_moments(centre, width, lower, upper, log_mass, low, high)
                    square = mean * mean + spread
                    sums[i, 1] += mass * (offset * offset - 2 * slope * offset * mean + slope * slope * square)
                    sums[i, 2] += mass * mean
                    position = 3 + others
                    sums[i, position] += mass * square
                    for a in range(others):
                        sums[i, 3 + a] += mass * across[line, a]
                        sums[i, position + 1 + a] += mass * mean * across[line, a]
                    position += 1 + others
                    for a in range(others):
                        for b in range(a, others):
                            sums[i, position] += mass * across[line, a] * across[line, b]
                            position += 1


@numba.njit(cache=True, nogil=True)
def _sum_derivatives(values, breakpoints, log_weight, times, noise, first, last, ln_density, derivatives, residual):
    """Sum the derivatives of ln p with respect to each of `values`, and the mean squared residual."""
    variance, log_noise = noise * noise, math.log(noise)
    for line in range(values.shape[0]):
        base = log_weight[line] - _HALF_LOG_TWO_PI
        for piece in range(values.shape[1] - 1):
            low, high = breakpoints[line, piece], breakpoints[line, piece + 1]
            if not high > low:
                continue
            for i in range(first, last):
                log_piece, offset, slope, centre, width, lower, upper, log_mass = _piece(
                    values[line, piece, i], values[line, piece + 1, i], low, high, times[i], variance, log_noise,
                    base, ln_density[i] - _NEGLIGIBLE)
                if log_piece == -np.inf:
                    continue
                mass = math.exp(log_piece - ln_density[i])
                mean, spread = _truncated_moments(centre, width, lower, upper, log_mass, low, high)
                mean_residual = offset - slope * mean
                scale = mass / (variance * (high - low))
                derivatives[line, piece, i] += scale * (mean_residual * (high - mean) + slope * spread)
                derivatives[line, piece + 1, i] += scale * (mean_residual * (mean - low) - slope * spread)
                residual[i] += mass * (mean_residual * mean_residual + slope * slope * spread)


@numba.njit(cache=True, nogil=True, inline="always")
def _piece(start, end, low, high, time, variance, log_noise, base, least):
    """ln of the integral over a piece, or -inf if it is below `least`, and the normal density of z on the piece.

    The residual is t - y = `offset` - `slope` z. Given the time, z has a normal density with mean `centre` and std
    `width`, truncated to `lower` to `upper` in units of `width` from `centre`; `log_mass` is the log of the probability
    of this interval.
    """
    slope = (end - start) / (high - low)
    offset = time - start + slope * low
    total = variance + slope * slope
    ratio = offset / total
    peak = base - 0.5 * offset * ratio
    if not peak - log_noise > least:  # also true for NaN
        return -np.inf, offset, slope, 0.0, 0.0, 0.0, 0.0, 0.0
    centre, width = slope * ratio, math.sqrt(variance / total)
    lower, upper = (low - centre) / width, (high - centre) / width
    nearest = max(0.0, lower, -upper)
    peak -= 0.5 * math.log(total)
    if peak - 0.5 * nearest * nearest < least:
        return -np.inf, offset, slope, centre, width, lower, upper, 0.0
    log_mass = _log_normal_mass(lower, upper)
    return peak + log_mass, offset, slope, centre, width, lower, upper, log_mass


@numba.njit(cache=True, nogil=True)
def _truncated_moments(centre, width, lower, upper, log_mass, low, high):
    """Mean and variance of the truncated normal density of a piece (see `_piece`), which lies between low and high."""
    left = math.exp(-0.5 * lower * lower - _HALF_LOG_TWO_PI - log_mass)
    right = math.exp(-0.5 * upper * upper - _HALF_LOG_TWO_PI - log_mass)
    mean = min(max(centre + width * (left - right), low), high)
    spread = width * width * (1.0 + lower * left - upper * right - (left - right) ** 2)
    return mean, max(spread, 0.0)


@numba.njit(cache=True, nogil=True)
def _log_normal_mass(low, high):
    """log(Phi(high) - Phi(low)) for low < high, accurate in either tail."""
    if low > 0.0:
        low, high = -high, -low
    if high > -25.0:
        mass = 0.5 * (math.erfc(-high * _ROOT_HALF) - math.erfc(-low * _ROOT_HALF))
        return math.log(mass) if mass > 0.0 else -np.inf
    ratio = math.exp(0.5 * (high - low) * (high + low)) * _mills(-high) / _mills(-low)  # Phi(low) over Phi(high)
    mass = 1.0 - ratio
    return math.log(mass / _mills(-high)) - 0.5 * high * high - _HALF_LOG_TWO_PI if mass > 0.0 else -np.inf


@numba.njit(cache=True, nogil=True)
def _mills(x):
    """phi(x) / Phi(-x) for large x, by the continued fraction x + 1/(x + 2/(x + ...))."""
    fraction = x
    for term in range(8, 0, -1):
        fraction = x + term / fraction
    return fraction
