"""The terms of sums over lattices of standard normals, for all conditions at a time."""

import math

import numba
import numpy as np

from slipstick.numerics.wide_vectors import WideCompiler
from slipstick.uncertainty.likelihood.exponential import exponential


@numba.njit(cache=True, nogil=True, error_model="numpy")
def beyond(times: np.ndarray, measured: np.ndarray, noise: float, distances: np.ndarray) -> np.ndarray:
    """-2 times the logarithm of the largest ratio (m,) that a point's terms have to the largest of their conditions."""
    m, n = times.shape
    least, nearest = np.full(n, np.inf), np.full(m, np.inf)
    for k in range(m):
        for i in range(n):
            residual = (measured[i] - times[k, i]) / noise
            term = distances[k] + residual * residual
            least[i] = term if term < least[i] else least[i]  # false for NaN
    for k in range(m):
        for i in range(n):
            residual = (measured[i] - times[k, i]) / noise
            above = distances[k] + residual * residual - least[i]
            if above < nearest[k]:
                nearest[k] = above
    return nearest


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, pipeline_class=WideCompiler)
def add(times: np.ndarray, measured: np.ndarray, noise: float, distances: np.ndarray, monomials: np.ndarray,
        peaks: np.ndarray, largest: np.ndarray, sums: np.ndarray) -> None:
    """Add the terms exp(-(|u|^2 + ((t - y) / s)^2) / 2) of the points to `sums` (r, n), in units of exp(`peaks`) (n,).

    The rows are the density, half the squared residual in units of the noise, and the `monomials` (m, r - 2) of u, or
    the density alone. `distances` (m,) are |u|^2. `largest` (n,) becomes the number of the point with the largest term
    where that is larger than `peaks`. A term for which the
    time is NaN is negligible.
    """
    scale, before = math.sqrt(0.5) / noise, peaks.copy()
    _raise_peaks(times, measured, scale, distances, peaks, largest)
    for i in range(len(peaks)):
        factor = math.exp(before[i] - peaks[i]) if before[i] < peaks[i] else 1.0
        for row in range(sums.shape[0]):
            sums[row, i] *= factor
    if sums.shape[0] == 1:
        _add_terms(times, measured, scale, distances, peaks, sums[0])
    else:
        _add_moments(times, measured, scale, distances, monomials, peaks, sums)


# Factors of a point are read before the loop over the conditions: LLVM makes vector instructions of it only then.


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, pipeline_class=WideCompiler)
def _raise_peaks(times: np.ndarray, measured: np.ndarray, scale: float, distances: np.ndarray, peaks: np.ndarray,
                 largest: np.ndarray) -> None:
    for k in range(times.shape[0]):
        distance, number = distances[k], float(k)  # a number as wide as the others, for vector instructions
        for i in range(times.shape[1]):
            residual = scale * (measured[i] - times[k, i])
            term = -0.5 * distance - residual * residual
            is_larger = term > peaks[i]  # false for NaN
            peaks[i] = term if is_larger else peaks[i]
            largest[i] = number if is_larger else largest[i]


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, pipeline_class=WideCompiler)
def _add_terms(times: np.ndarray, measured: np.ndarray, scale: float, distances: np.ndarray, peaks: np.ndarray,
               total: np.ndarray) -> None:
    for k in range(times.shape[0]):
        exponent = -0.5 * distances[k]
        for i in range(times.shape[1]):
            residual = scale * (measured[i] - times[k, i])
            square = residual * residual
            term = exponential(exponent - square - peaks[i])
            total[i] += term if square >= 0.0 else 0.0  # 0 for NaN


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, pipeline_class=WideCompiler)
def _add_moments(times: np.ndarray, measured: np.ndarray, scale: float, distances: np.ndarray, monomials: np.ndarray,
                 peaks: np.ndarray, sums: np.ndarray) -> None:
    n = len(peaks)
    terms, halves = np.empty(n), np.empty(n)
    for k in range(times.shape[0]):
        exponent = -0.5 * distances[k]
        for i in range(n):
            residual = scale * (measured[i] - times[k, i])
            square = residual * residual
            term = exponential(exponent - square - peaks[i])
            terms[i], halves[i] = (term, term * square) if square >= 0.0 else (0.0, 0.0)  # 0 for NaN
        for i in range(n):
            sums[0, i] += terms[i]
            sums[1, i] += halves[i]
        for column in range(monomials.shape[1]):
            factor = monomials[k, column]
            for i in range(n):
                sums[2 + column, i] += factor * terms[i]
