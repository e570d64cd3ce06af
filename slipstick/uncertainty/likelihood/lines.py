"""The density of a measured time, integrated along lines through the space of the standard normals.

    p = sum over lines j of w_j * integral of phi(z) N(t; y_j(z), s^2) dz

Between two breakpoints of a line y is taken as linear, y = a + b z. There the integrand is a normal density:

    phi(z) N(t; a + b z, s^2) = N(t; a, s^2 + b^2) N(z; m, v),   m = b (t - a)/(s^2 + b^2),   v = s^2/(s^2 + b^2)

so each piece has a closed form, however narrow the noise s and however far t, in logarithms. Along the axis of a
table, broken at its grid lines, that is the integral of the interpolated table itself.
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
_NEGLIGIBLE = 32.0  # a piece this far below the sum so far, in natural logarithms, adds less than 1e-13 of it
_FEWEST = 64  # conditions a thread takes


@dataclass(frozen=True, eq=False)
class Lines:
    """m lines of g points each in d standard normals u = (z, across), with the normal scores `factor` u of the inputs.

    Along line j z takes the rising `breakpoints` (m, g), while the others stay at `across` (m, d - 1).
    `log_weight` (m,) is of the rule across the lines: along them the normal density is integrated here.
    """

    breakpoints: np.ndarray
    across: np.ndarray
    log_weight: np.ndarray
    factor: np.ndarray

    @property
    def scores(self) -> np.ndarray:
        """Normal scores of the inputs at all points, line after line: shape (m g, d)."""
        m, g = self.breakpoints.shape
        scores: np.ndarray = (self.breakpoints[:, :, None] * self.factor[:, 0]
                              + (np.einsum("mj,ij->mi", self.across, self.factor[:, 1:]))[:, None, :])
        return scores.reshape(m * g, len(self.factor))


@dataclass(frozen=True, eq=False)
class Moments:
    """What u and the residual are, given the measured times of n conditions.

    Mean u `first` (n, d), mean products `second` (n, d, d), and mean squared residual `residual` (n,) in s^2: by
    Fisher's identity all that a gradient of the likelihood needs. NaN where a time has no density.
    """

    first: np.ndarray
    second: np.ndarray
    residual: np.ndarray


def log10_density(lines: Lines, outputs: np.ndarray, times: np.ndarray, output_std: float) -> np.ndarray:
    """log10 p per ms, shape (n,), from outputs (m g, n) s at the points of the lines; -inf where all are NaN.

    A piece with a NaN at either end has no density.
    """
    return _integrate(lines, outputs, times, output_std, 1)[0]


def density_and_moments(lines: Lines, outputs: np.ndarray, times: np.ndarray, output_std: float) -> tuple[np.ndarray, Moments]:
    """As `log10_density`, with the moments behind the gradient."""
    d, n = len(lines.factor), len(times)
    log_density, sums = _integrate(lines, outputs, times, output_std, 2 + d + d * (d + 1) // 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        moments = sums[:, 1:] / sums[:, :1]
    second, (rows, columns) = np.empty((n, d, d)), np.triu_indices(d)
    second[:, rows, columns] = second[:, columns, rows] = moments[:, 1 + d:]
    return log_density, Moments(moments[:, 1:1 + d], second, moments[:, 0])


def density_and_derivatives(lines: Lines, outputs: np.ndarray, times: np.ndarray,
                 output_std: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `log10_density`, with the derivatives of ln p in each output, shape (m g, n) in 1/s, and in ln noise (n,).

    They are 0 where a time has no density.
    """
    log_density = log10_density(lines, outputs, times, output_std)
    values = np.ascontiguousarray(outputs).reshape(*lines.breakpoints.shape, len(times))
    changes, residual = np.zeros(values.shape), np.zeros(len(times))
    natural = (log_density + 3.0) * _LN10
    _share_out(len(times), lambda first, last: _sum_changes(
        values, lines.breakpoints, lines.log_weight, times, output_std, first, last, natural, changes, residual))
    of_noise = np.where(np.isfinite(natural), residual / output_std**2 - 1.0, 0.0)
    return log_density, changes.reshape(outputs.shape), of_noise


def _integrate(lines: Lines, outputs: np.ndarray, times: np.ndarray, output_std: float,
               columns: int) -> tuple[np.ndarray, np.ndarray]:
    n = len(times)
    values = np.ascontiguousarray(outputs).reshape(*lines.breakpoints.shape, n)
    top, sums = np.full(n, -np.inf), np.zeros((n, columns))
    _share_out(n, lambda first, last: _sum_pieces(
        values, lines.breakpoints, lines.log_weight, lines.across, times, output_std, first, last, top, sums))
    with np.errstate(divide="ignore"):
        return (top + np.log(sums[:, 0])) / _LN10 - 3.0, sums


def _share_out(count: int, work: Callable[[int, int], None]) -> None:
    """Have threads work on all conditions, each on those from a first to a last."""
    threads = min(os.cpu_count() or 1, max(1, count // _FEWEST))
    edges = np.linspace(0, count, threads + 1).astype(int)
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, edges[:-1], edges[1:]))


@numba.njit(cache=True, nogil=True)
def _sum_pieces(values, breakpoints, log_weight, across, times, noise, first, last, top, sums):
    """Add up all pieces of conditions `first` to `last`; `sums` are in units of exp(`top`).

    Columns of `sums`: density, squared residual, then first and second moments of (z, across).
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
                log_piece, gap, slope, centre, width, u, v, log_mass = _piece(
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
                    mean, spread = _within(centre, width, u, v, log_mass, low, high)
                    square = mean * mean + spread
                    sums[i, 1] += mass * (gap * gap - 2 * slope * gap * mean + slope * slope * square)
                    sums[i, 2] += mass * mean
                    place = 3 + others
                    sums[i, place] += mass * square
                    for a in range(others):
                        sums[i, 3 + a] += mass * across[line, a]
                        sums[i, place + 1 + a] += mass * mean * across[line, a]
                    place += 1 + others
                    for a in range(others):
                        for b in range(a, others):
                            sums[i, place] += mass * across[line, a] * across[line, b]
                            place += 1


@numba.njit(cache=True, nogil=True)
def _sum_changes(values, breakpoints, log_weight, times, noise, first, last, whole, changes, residual):
    """Add up what ln p, which is `whole`, changes with each of `values`, and the mean squared residual."""
    variance, log_noise = noise * noise, math.log(noise)
    for line in range(values.shape[0]):
        base = log_weight[line] - _HALF_LOG_TWO_PI
        for piece in range(values.shape[1] - 1):
            low, high = breakpoints[line, piece], breakpoints[line, piece + 1]
            if not high > low:
                continue
            for i in range(first, last):
                log_piece, gap, slope, centre, width, u, v, log_mass = _piece(
                    values[line, piece, i], values[line, piece + 1, i], low, high, times[i], variance, log_noise,
                    base, whole[i] - _NEGLIGIBLE)
                if log_piece == -np.inf:
                    continue
                mass = math.exp(log_piece - whole[i])
                mean, spread = _within(centre, width, u, v, log_mass, low, high)
                off = gap - slope * mean
                share = mass / (variance * (high - low))
                changes[line, piece, i] += share * (off * (high - mean) + slope * spread)
                changes[line, piece + 1, i] += share * (off * (mean - low) - slope * spread)
                residual[i] += mass * (off * off + slope * slope * spread)


@numba.njit(cache=True, nogil=True, inline="always")
def _piece(start, end, low, high, time, variance, log_noise, base, least):
    """log of a piece, -inf where it is below `least`, gap and slope of t - y = gap - slope z, and z given the time.

    That is normal with centre and width, goes from u to v in widths, and has the log mass.
    """
    slope = (end - start) / (high - low)
    gap = time - start + slope * low
    total = variance + slope * slope
    ratio = gap / total
    peak = base - 0.5 * gap * ratio
    if not peak - log_noise > least:  # NaN ends here, too
        return -np.inf, gap, slope, 0.0, 0.0, 0.0, 0.0, 0.0
    centre, width = slope * ratio, math.sqrt(variance / total)
    u, v = (low - centre) / width, (high - centre) / width
    nearest = max(0.0, u, -v)
    peak -= 0.5 * math.log(total)
    if peak - 0.5 * nearest * nearest < least:
        return -np.inf, gap, slope, centre, width, u, v, 0.0
    log_mass = _log_normal_mass(u, v)
    return peak + log_mass, gap, slope, centre, width, u, v, log_mass


@numba.njit(cache=True, nogil=True)
def _within(centre, width, u, v, log_mass, low, high):
    """Mean and variance of the normal variable of a piece within it."""
    left = math.exp(-0.5 * u * u - _HALF_LOG_TWO_PI - log_mass)
    right = math.exp(-0.5 * v * v - _HALF_LOG_TWO_PI - log_mass)
    mean = min(max(centre + width * (left - right), low), high)
    spread = width * width * (1.0 + u * left - v * right - (left - right) ** 2)
    return mean, max(spread, 0.0)


@numba.njit(cache=True, nogil=True)
def _log_normal_mass(low, high):
    """log(Phi(high) - Phi(low)) for low < high, with all its digits in either tail."""
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
    """phi(x) / Phi(-x) for a large x, by its continued fraction x + 1/(x + 2/(x + ...))."""
    fraction = x
    for term in range(8, 0, -1):
        fraction = x + term / fraction
    return fraction
