"""The integrals over the pieces of lines (lines.py), for blocks of conditions whose loops become vector instructions.

On a piece from z_0 to z_1, the integrand f(z) = exp(-z^2 / 2 - (t - a - b z)^2 / (2 s^2)) is a normal density with the
centre m and the width w, up to a factor. With the Mills ratio R(x) = (1 - Phi(x)) / phi(x), the integral is

    w (R(x_0) f(z_0) - R(x_1) f(z_1))                            for 0 <= x_0 < x_1,   x_i = (z_i - m) / w
    w (sqrt(2 pi) f(m) - R(-x_0) f(z_0) - R(x_1) f(z_1))         for x_0 < 0 < x_1

and so on by symmetry. It requires no error function, and is accurate in either tail. exp and R are polynomials after a
reduction of the range, because the functions of a library would keep the loops from becoming vector instructions. Every
condition passes through the same instructions, also in a block that is not full, and its result does not depend on the
others.
"""

import math

import numba
import numpy as np

from slipstick.uncertainty.likelihood.exponential import exponential

LANES = 32
"""Number of conditions of a block."""
_NEGLIGIBLE = 32.0  # natural log below the largest integrand at which a piece contributes less than about 1e-13
_ROOT_TWO_PI = math.sqrt(2 * math.pi)
_SCALE = 5.0  # with t = 5 / (5 + x), R(x) / t is a polynomial of degree 18 in t, with a relative error of 3e-14
(TIME, TOP, PER_DENSITY, START, END, OFFSET, SLOPE, PER_TOTAL, CENTRE, PEAK, AT_START, AT_END, HIGHEST, WIDTH, MASS,
 MEAN, SPREAD, RESIDUAL, MISFIT, TILT, BY_START, BY_END, WORK) = range(0, 23 * LANES, LANES)
"""First indices in the work array of a block, which is flat because the compiler then knows the distance of two rows.

- Of the conditions: measured times t, ln of the largest integrand, 1 / p.
- Of a piece: times of the model at its ends, t - a, b, 1 / (s^2 + b^2), m, ln f(m), ln f(z_0) and ln f(z_1) (later f
  itself), the largest ln f on it, w, the integral of f, mean and variance of z, mean squared residual, mean residual,
  b times the variance of z, and the derivatives of ln p with respect to the times at its ends.
"""
_R = (
    0.1999999999999956, 0.20000000000340704, 0.19199999957401287, 0.1760000213052966, 0.15295943087898908,
    0.12480937105534806, 0.09410459649721398, 0.0650621281438599, 0.03328107238389512, 0.03692440208473474,
    -0.05974561306893056, 0.15321166293793617, -0.29862297921882663, 0.4118189198013984, -0.4317971781680459,
    0.31528201542402573, -0.14601953406082957, 0.03845380481920744, -0.004407983077199836,
)
"""Coefficients of R(x) / t, lowest degree first: its interpolation in the Chebyshev points of 0 < t < 1.

`test_the_coefficients_interpolate_the_mills_ratio` computes them. Here they would need SciPy's special functions, whose
import takes a tenth of the start of the service.
"""


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _mills(t):
    """R(x) for x >= 0, with t = scale / (scale + x)."""
    return t * (_R[0] + t * (_R[1] + t * (_R[2] + t * (_R[3] + t * (_R[4] + t * (_R[5] + t * (_R[6] + t * (
        _R[7] + t * (_R[8] + t * (_R[9] + t * (_R[10] + t * (_R[11] + t * (_R[12] + t * (_R[13] + t * (_R[14] + t * (
            _R[15] + t * (_R[16] + t * (_R[17] + t * _R[18]))))))))))))))))))


@numba.njit(cache=True, nogil=True)
def _allocate(count):
    """A flat array at the beginning of a line of the cache: vectors across two lines are slow."""
    flat = np.empty(count + 8)
    first = -(flat.ctypes.data // 8) % 8
    return flat[first:first + count]


@numba.njit(cache=True, nogil=True)
def _load(source, first, count, work, row):
    for lane in range(count):
        work[row + lane] = source[first + lane]
    for lane in range(count, LANES):
        work[row + lane] = np.nan


@numba.njit(cache=True, nogil=True)
def _load_ends(values, line, piece, first, count, work):
    if count == LANES:  # a constant number of iterations is faster
        for lane in range(LANES):
            work[START + lane] = values[line, piece, first + lane]
            work[END + lane] = values[line, piece + 1, first + lane]
    else:
        for lane in range(count):
            work[START + lane] = values[line, piece, first + lane]
            work[END + lane] = values[line, piece + 1, first + lane]


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _place(work, low, high, base, variance):
    """Offset to HIGHEST of a piece from `low` to `high`; HIGHEST is -inf for a time of NaN. The number of conditions
    for which the piece is not negligible."""
    per_length, half, count = 1 / (high - low), 0.5 / variance, 0
    base_low, base_high = base - 0.5 * low * low, base - 0.5 * high * high
    for lane in range(LANES):
        time, start, end = work[TIME + lane], work[START + lane], work[END + lane]
        slope = (end - start) * per_length
        offset = time - start + slope * low
        total = variance + slope * slope
        per_total = 1 / total
        ratio = offset * per_total
        centre, peak = slope * ratio, base - 0.5 * offset * ratio
        at_start = base_low - half * (time - start) * (time - start)
        at_end = base_high - half * (time - end) * (time - end)
        higher = at_start if at_start > at_end else at_end
        highest = peak if (centre > low) & (centre < high) else higher
        highest = highest if total > 0.0 else -np.inf
        work[OFFSET + lane], work[SLOPE + lane], work[CENTRE + lane], work[PEAK + lane] = offset, slope, centre, peak
        work[AT_START + lane], work[AT_END + lane], work[HIGHEST + lane] = at_start, at_end, highest
        work[PER_TOTAL + lane] = per_total
        count += 1 if highest > work[TOP + lane] - _NEGLIGIBLE else 0
    return count


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _integrate(work, low, high, variance):
    """MASS of the piece that was placed, and what `_moments` requires."""
    per_variance = 1 / variance
    for lane in range(LANES):
        top, centre, slope = work[TOP + lane], work[CENTRE + lane], work[SLOPE + lane]
        width = math.sqrt(variance * work[PER_TOTAL + lane])
        per_width = width * (variance + slope * slope) * per_variance
        lower, upper = (low - centre) * per_width, (high - centre) * per_width
        below, above = _SCALE + abs(lower), _SCALE + abs(upper)
        both = _SCALE / (below * above)
        at_start, at_end = exponential(work[AT_START + lane] - top), exponential(work[AT_END + lane] - top)
        left, right = at_start * _mills(both * above), at_end * _mills(both * below)
        peak = exponential(work[PEAK + lane] - top) if (lower < 0.0) & (upper > 0.0) else 0.0
        mass = width * (_ROOT_TWO_PI * peak + (left if lower >= 0.0 else -left) - (right if upper > 0.0 else -right))
        work[MASS + lane] = mass if (mass > 0.0) & (work[HIGHEST + lane] > top - _NEGLIGIBLE) else 0.0
        work[AT_START + lane], work[AT_END + lane], work[WIDTH + lane] = at_start, at_end, width


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _moments(work, low, high):
    """MEAN to TILT of the piece that was integrated, 0 where MASS is 0."""
    for lane in range(LANES):
        mass, centre, slope, width = work[MASS + lane], work[CENTRE + lane], work[SLOPE + lane], work[WIDTH + lane]
        per_mass = width / mass
        at_start, at_end = work[AT_START + lane] * per_mass, work[AT_END + lane] * per_mass
        shift = at_start - at_end
        mean = centre + width * shift
        mean = mean if mean > low else low
        mean = mean if mean < high else high
        spread = width * (width * (1.0 - shift * shift) + (low - centre) * at_start - (high - centre) * at_end)
        spread = spread if spread > 0.0 else 0.0
        misfit = work[OFFSET + lane] - slope * mean
        is_counted = mass > 0.0
        work[MEAN + lane], work[SPREAD + lane] = mean if is_counted else 0.0, spread if is_counted else 0.0
        work[RESIDUAL + lane] = misfit * misfit + slope * slope * spread if is_counted else 0.0
        work[MISFIT + lane], work[TILT + lane] = misfit if is_counted else 0.0, slope * spread if is_counted else 0.0


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def sum_pieces(values, breakpoints, log_weight, across, times, noise, first, last, top, sums):
    """Sum all pieces for the conditions from `first` up to `last`; `sums` are in units of exp(`top`).

    Columns of `sums`: density, squared residual, first moments and second moments of (z, across).
    """
    variance, columns = noise * noise, sums.shape[1]
    blocks = (last - first + LANES - 1) // LANES
    work, of_line = _allocate(WORK), _allocate(4 * LANES)
    tops, totals = _allocate(blocks * LANES), _allocate(blocks * columns * LANES).reshape(blocks, columns, LANES)
    tops[:], totals[:] = -np.inf, 0.0
    for line in range(values.shape[0]):  # outermost, in the order of the memory
        for block in range(blocks):
            start = first + block * LANES
            count, before = min(LANES, last - start), tops[block * LANES:(block + 1) * LANES]
            work[:] = np.nan
            _load(times, start, count, work, TIME)
            _load(before, 0, LANES, work, TOP)
            for piece in range(values.shape[1] - 1):
                low, high = breakpoints[line, piece], breakpoints[line, piece + 1]
                if high > low:
                    _load_ends(values, line, piece, start, count, work)
                    _place(work, low, high, log_weight[line], variance)
                    _raise_top(work)
            _rescale(before, work, totals[block])
            of_line[:] = 0.0
            for piece in range(values.shape[1] - 1):
                low, high = breakpoints[line, piece], breakpoints[line, piece + 1]
                if high > low:
                    _load_ends(values, line, piece, start, count, work)
                    if _place(work, low, high, log_weight[line], variance) > 0:
                        _integrate(work, low, high, variance)
                        if columns > 1:
                            _moments(work, low, high)
                            _add_moments(work, of_line)
                        for lane in range(LANES):
                            of_line[lane] += work[MASS + lane]
            _add_line(of_line, across[line], totals[block])
    for condition in range(first, last):
        block, lane = (condition - first) // LANES, (condition - first) % LANES
        top[condition] = tops[condition - first]
        for column in range(columns):
            sums[condition, column] = totals[block, column, lane]


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _add_line(of_line, across, totals):
    """Add the sums over the pieces of a line, on which the other components of u are `across`, to those of a block."""
    others = len(across)
    for lane in range(LANES):
        mass, mean = of_line[lane], of_line[LANES + lane]
        totals[0, lane] += mass
        if len(totals) > 1:
            totals[1, lane] += of_line[3 * LANES + lane]
            totals[2, lane] += mean
            totals[3 + others, lane] += of_line[2 * LANES + lane]
            row = 4 + 2 * others
            for a in range(others):
                totals[3 + a, lane] += across[a] * mass
                totals[4 + others + a, lane] += across[a] * mean
                for b in range(a, others):
                    totals[row, lane] += across[a] * across[b] * mass
                    row += 1


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _raise_top(work):
    for lane in range(LANES):
        top, highest = work[TOP + lane], work[HIGHEST + lane]
        work[TOP + lane] = highest if highest > top else top


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _rescale(before, work, total):
    """Change the units of the sums from exp(`before`) to exp(TOP)."""
    for lane in range(LANES):
        top = work[TOP + lane]
        factor = exponential(before[lane] - top) if before[lane] < top else 1.0
        before[lane] = top
        for column in range(total.shape[0]):
            total[column, lane] *= factor


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _add_moments(work, of_line):
    for lane in range(LANES):
        mass, mean = work[MASS + lane], work[MEAN + lane]
        of_line[1 * LANES + lane] += mass * mean
        of_line[2 * LANES + lane] += mass * (mean * mean + work[SPREAD + lane])
        of_line[3 * LANES + lane] += mass * work[RESIDUAL + lane]


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def sum_derivatives(values, breakpoints, log_weight, times, noise, first, last, top, per_density, derivatives,
                    residual):
    """Sum the derivatives of ln p with respect to each of `values`, and the mean squared residual.

    `per_density` is 1 / p in units of exp(-`top`), as from `sum_pieces`, and 0 where p is 0.
    """
    work, variance = _allocate(WORK), noise * noise
    for line in range(values.shape[0]):
        for start in range(first, last, LANES):
            count = min(LANES, last - start)
            work[:] = np.nan
            _load(times, start, count, work, TIME)
            _load(top, start, count, work, TOP)
            _load(per_density, start, count, work, PER_DENSITY)
            for piece in range(values.shape[1] - 1):
                low, high = breakpoints[line, piece], breakpoints[line, piece + 1]
                if high > low:
                    _load_ends(values, line, piece, start, count, work)
                    if _place(work, low, high, log_weight[line], variance) > 0:
                        _integrate(work, low, high, variance)
                        _moments(work, low, high)
                        _differentiate(work, low, high, 1 / (variance * (high - low)))
                        for lane in range(count):
                            derivatives[line, piece, start + lane] += work[BY_START + lane]
                            derivatives[line, piece + 1, start + lane] += work[BY_END + lane]
                            residual[start + lane] += work[RESIDUAL + lane]


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _differentiate(work, low, high, scale):
    """BY_START and BY_END of the piece, and RESIDUAL weighted with the mass.

    Without conditions, which would keep this loop from becoming vector instructions.
    """
    for lane in range(LANES):
        share, mean = work[MASS + lane] * work[PER_DENSITY + lane], work[MEAN + lane]
        misfit, tilt = work[MISFIT + lane], work[TILT + lane]
        work[BY_START + lane] = scale * share * (misfit * (high - mean) + tilt)
        work[BY_END + lane] = scale * share * (misfit * (mean - low) - tilt)
        work[RESIDUAL + lane] = share * work[RESIDUAL + lane]
