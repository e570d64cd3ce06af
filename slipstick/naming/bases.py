"""Bases of free laws: piecewise linear functions of what a law depends on."""

import numpy as np
from numba import njit

from slipstick.numerics.piecewise import hats
from slipstick.numerics.threads import mapped, parts_of

_OUTERMOST = 0.001
"""Share of the values beyond the outermost knots, so that a few odd samples do not place them."""

_NARROWEST = 1e-9
"""Least distance from the first knot to the last, so that a quantity that is constant has distinct knots."""


def doubled(knots: int, times: int) -> int:
    """Number of knots with twice as many intervals, so many `times`."""
    return ((knots - 1) << times) + 1


def from_zero(x: np.ndarray, seen: np.ndarray, count: int) -> np.ndarray:
    """Knots (count,) for a quantity with a natural zero, closer near it, over values x where `seen`, both (n, k)."""
    return np.asarray(max(_reach(x, seen)[1], _NARROWEST) * np.linspace(0, 1, count) ** 2)


def evenly(x: np.ndarray, seen: np.ndarray, count: int) -> np.ndarray:
    """Knots (count,) at equal distances over the values x where `seen`, both (n, k)."""
    low, high = _reach(x, seen)
    return np.linspace(low, max(high, low + _NARROWEST), count)


def _reach(x: np.ndarray, seen: np.ndarray) -> tuple[float, float]:
    """The outermost values of x where `seen` that two runs reach: what one alone reaches, no other can confirm."""
    if not seen.any():
        return 0.0, 1.0
    low, high = np.quantile(x[seen], [_OUTERMOST, 1 - _OUTERMOST])
    runs = seen.any(axis=1)
    if runs.sum() > 1:
        low = max(low, np.sort(np.where(seen, x, np.inf)[runs].min(axis=1))[1])
        high = min(high, np.sort(np.where(seen, x, -np.inf)[runs].max(axis=1))[-2])
    return float(low), float(high)


def supported(knots: np.ndarray, x: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """The `knots` (m,) from the least of the values x where `seen`, both (n, k), on; that value is the first of them.

    A knot below all values is the end of a line through values above it, and tells nothing of a law that bends there.
    """
    low = float(x[seen].min()) if seen.any() else knots[0]
    return np.concatenate([[max(low, knots[0])], knots[knots > max(low, knots[0])]])


def between(values: np.ndarray, count: int, centred: bool = True) -> np.ndarray:
    """Basis (n, m) over a quantity that is constant in a run, (n,): at most `count` levels, or hats where it has more.

    Where `centred`, each column has mean 0 over the runs, and the first level has none: what all runs have in common
    belongs to the parameters of the block. Where all runs have the same value there is no column.
    """
    basis = hats(values, between_knots(values, count))
    if not centred:
        return basis if np.ptp(values) > 0 else basis[:, :0]
    return np.asarray(basis[:, 1:] - basis[:, 1:].mean(axis=0))


def between_knots(values: np.ndarray, count: int) -> np.ndarray:
    """Knots (m + 1,) of `between`, in the unit of the values: one fewer than `count` of hats, but at least two."""
    levels = np.unique(values)
    return levels if len(levels) <= count else np.unique(np.quantile(values, np.linspace(0, 1, max(2, count - 1))))


def gain_basis(signal: np.ndarray, largest: float, finer: int = 0) -> np.ndarray:
    """Gain errors (n, m, k) of a sensor of a `signal` (n, k): a share of it, and one that grows up to the `largest`.

    Where `finer`, a gain is a share of the signal that is linear between `gain_points`.
    """
    if finer:
        return np.asarray(hats(np.abs(signal), largest * gain_points(finer)) * signal[:, None])
    return np.stack([signal, signal * np.abs(signal) / largest], axis=1)


def gain_points(finer: int) -> np.ndarray:
    """Points of a `finer` gain of a sensor, over the largest signal."""
    return np.linspace(0, 1, 2 ** (finer + 1) + 1)


def delayed(signal: np.ndarray, late: float) -> np.ndarray:
    """Signals (..., k) that are `late` samples, linear between two samples; constant before the first, after the last.
    """
    if late == 0:
        return signal
    shifted = np.empty(signal.shape)
    _delay(np.ascontiguousarray(signal).reshape(-1, signal.shape[-1]), late, shifted.reshape(-1, signal.shape[-1]))
    return shifted


@njit(nogil=True, cache=True, error_model="numpy")
def _delay(signal, late, shifted):  # type: ignore[no-untyped-def]
    n, k = signal.shape
    whole = int(np.ceil(late))
    share = whole - late  # of the later one of two samples
    begin = min(max(whole, 0), k)
    end = max(begin, min(k, k - 1 + whole))
    for i in range(n):
        shifted[i, :begin] = signal[i, 0]
        for t in range(begin, end):
            shifted[i, t] = signal[i, t - whole] * (1 - share) + signal[i, t - whole + 1] * share
        shifted[i, end:] = signal[i, -1]


def delayed_times(basis: np.ndarray, late: float, factor: np.ndarray) -> np.ndarray:
    """`factor` (n, k) times the columns of a `basis` (n, m, k) that are `late` samples, as `delayed` ones are.

    In one pass: the basis of a law with many knots does not fit into a cache.
    """
    products = np.empty(basis.shape)
    mapped(lambda rows: _delay_times(basis[rows], late, factor[rows], products[rows]), parts_of(len(basis)))
    return products


@njit(nogil=True, cache=True, error_model="numpy")
def _delay_times(basis, late, factor, products):  # type: ignore[no-untyped-def]
    for i in range(basis.shape[0]):
        _delay(basis[i], late, products[i])
        for j in range(basis.shape[1]):
            for t in range(basis.shape[2]):
                products[i, j, t] *= factor[i, t]


def late(signal: np.ndarray, time: np.ndarray, clock: float) -> np.ndarray:
    """Change (n, k) of the reading of a signal (n, k) whose clock is late by `clock` s.

    By a parabola through three samples: a line between two of them would smooth the signal, which looks like a lag.
    """
    slope, bend = _differences(signal)
    by = clock / (time[1] - time[0])
    return np.asarray(by * (0.5 * by * bend - slope))


def later(signal: np.ndarray, time: np.ndarray, clock: float) -> np.ndarray:
    """Derivative (n, k) of `late` with respect to the clock, in the unit of the signal per s."""
    slope, bend = _differences(signal)
    step = time[1] - time[0]
    return np.asarray((clock / step * bend - slope) / step)


def _differences(signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and second central differences (n, k) of a signal (n, k), which is constant before and after."""
    wide = np.pad(signal, ((0, 0), (1, 1)), mode="edge")
    return 0.5 * (wide[:, 2:] - wide[:, :-2]), wide[:, 2:] - 2 * signal + wide[:, :-2]


def bent(signal: np.ndarray) -> np.ndarray:
    """Samples (n, k) between which a line has the integral of a `signal` (n, k) that bends between its samples.

    That is less than the trapezoid by a twelfth of the change of its slope (the first term of the Euler-Maclaurin
    formula).
    """
    return np.asarray(signal - _differences(signal)[1] / 12)
