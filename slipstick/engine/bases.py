"""What a law may be: functions of a variable, with a prior whose amplitude and smoothness are estimated.

A law is a P-spline (Eilers and Marx, Statistical Science 11, 89, 1996): hat functions in number, with the prior of an
integrated random walk, which is a penalty on second differences, beside a constant and a line of the same amplitude.
Its two hyperparameters, amplitude and share of the walk, are those of the largest marginal likelihood (Wood, J. R.
Stat. Soc. B 73, 3, 2011): no knots are chosen. The past of an input is weighted in the same way: what the input leaves
after mechanical plays, over their width, and after first-order lags, over their time.
"""

from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np
import scipy
from numba import njit

from slipstick.engine.equations import EDGE, beside_jump
from slipstick.numerics.memory import play, weigh_lags
from slipstick.numerics.piecewise import hats, slope

Kind = Literal["curve", "between", "own", "past", "lags"]

MOST = 60
"""Hat functions of a law over a signal."""
COARSE = 8
"""Of a law in the first comparison of all candidates."""
_SAMPLE = 20_000
"""Samples by which knots are placed."""
OUTERMOST = 0.001
"""Share of the samples beyond the outermost knots."""
_FEW_RUNS = 2
"""Runs for each hat function of a law over what is constant in a run."""
WALKS = (0.0, 0.3, 1.0, 3.0, 10.0)
"""Standard deviations of the walk over that of the line: the grid of smoothness."""
WIDTHS, TIMES, DELAYS = np.geomspace(0.003, 0.5, 12), np.geomspace(0.5, 256, 14), np.geomspace(0.5, 64, 8)
"""Of plays, over the range of the signal, and of lags and dead times in samples."""
RELAXATIONS, PLACES = np.geomspace(2, 128, 4), np.array([-0.2, -0.05, 0.0, 0.05, 0.2])
"""Times in samples over which a signal is forgotten, and places over its range at which laws of what is not bend."""


@dataclass(frozen=True, eq=False)
class Variable:
    """What a law depends on, `name` in `unit`, with `knots` (m,).

    `values` are (n, K) of a "curve", (n,) of a law "between" runs, and the signal (n, K) whose "lags", or whose plays
    and lags (its "past"), are taken; an "own" variable has those of the system, and none here. `jumps` tells that an
    own variable is a switching state, over which a law may jump at 0. Values have `fine` instants in a sample.
    """

    name: str
    unit: str
    kind: Kind
    knots: np.ndarray
    values: np.ndarray | None = None
    jumps: bool = False
    fine: float = 1

    @property
    def families(self) -> tuple[int, ...]:
        """Numbers of coefficients whose order is that of a variable: each has a smooth prior of its own."""
        if self.kind not in ("past", "lags"):
            return len(self.knots),
        return len(WIDTHS if self.kind == "past" else DELAYS), len(TIMES), *[len(PLACES)] * len(RELAXATIONS)

    @property
    def _slices(self) -> list[slice]:
        """The places of the coefficients of each family."""
        ends = np.cumsum(self.families).tolist()
        return [slice(end - count, end) for end, count in zip(ends, self.families, strict=True)]

    def _beside(self, values: np.ndarray) -> np.ndarray:
        """Return values on their sides of 0, if the law may jump there."""
        return beside_jump(values, np.sign(values), self.knots) if self.jumps else values

    def coarse(self) -> "Variable":
        """Return the variable with few knots, for a first comparison."""
        count = len(self.knots)
        if self.kind not in ("curve", "own") or count <= COARSE:
            return self
        chosen = np.unique(np.round(np.linspace(0, count - 1, COARSE)).astype(int))
        if self.jumps:
            chosen = np.union1d(chosen, np.flatnonzero(np.abs(self.knots) <= 2 * EDGE * np.ptp(self.knots)))
        return replace(self, knots=self.knots[chosen])

    def basis(self, own: np.ndarray | None = None) -> np.ndarray:
        """Return the functions (n, m, K) of the variable, with the `own` values (n, K); (n, m, 1) between runs."""
        values = own if self.values is None else self.values
        assert values is not None
        if self.kind in ("past", "lags"):
            return np.concatenate([self._remember(values, family) for family in range(len(self.families))], axis=1)
        x = np.asarray(values if values.ndim == 2 else values[:, None])
        return hats(self._beside(x), self.knots)

    def _remember(self, values: np.ndarray, family: int) -> np.ndarray:
        """Return the functions (n, m, K) of a family of the past of a signal (n, K): what it is beyond the signal."""
        knots = self.knots[self._slices[family]]
        if family > 1:  # functions of what is not forgotten yet
            excess = values - lag(values, RELAXATIONS[family - 2] * self.fine)
            return np.stack([np.maximum(excess - knot, 0) - max(-knot, 0) for knot in knots], axis=1)
        if family == 1:
            kept = [lag(values, time * self.fine) for time in knots]
        else:
            kept = [play(values, knot) if self.kind == "past" else late(values, knot * self.fine, 1) for knot in knots]
        return np.asarray(np.stack(kept, axis=1) - values[:, None])

    def weigh(self, c: np.ndarray, own: np.ndarray | None = None) -> np.ndarray:
        """Return a law (n, K), or (n, 1) between runs, with coefficients c (m,)."""
        values = own if self.values is None else self.values
        assert values is not None
        if self.kind == "lags":  # without the basis, which is large
            dead, lagging, *relaxing = self._slices
            values = np.ascontiguousarray(values, dtype=float)
            law = (weigh_lags(values, self.knots[lagging] * self.fine, c[lagging])
                   + weigh_delays(values, self.knots[dead] * self.fine, c[dead]))
            for places, time in zip(relaxing, RELAXATIONS, strict=True):
                law += weigh_bends(values - lag(values, time * self.fine), self.knots[places], c[places])
            return np.asarray(law)
        if len(self.knots) > 1 and self.kind != "past":
            return np.asarray(np.interp(self._beside(values), self.knots, c).reshape(len(values), -1))
        return np.asarray(np.einsum("m,nmk->nk", c, self.basis(own)))

    def differentiate(self, c: np.ndarray, own: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return how a law over an `own` signal (n, K), with coefficients c (m,), changes with that (n, m, K)."""
        if self.kind != "lags":
            return np.asarray(slope(self._beside(own), self.knots, c)[:, None] * change)
        (dead, lagging, *relaxing), out = self._slices, np.zeros(change.shape)
        bends = np.stack([slope_of_bends(own - lag(own, time * self.fine), self.knots[places], c[places])
                          for places, time in zip(relaxing, RELAXATIONS, strict=True)])
        times = np.concatenate([self.knots[lagging], RELAXATIONS]) * self.fine
        respond_to_lags(np.ascontiguousarray(change), self.knots[dead] * self.fine, c[dead], times, c[lagging], bends,
                        out)
        return out


def curve(name: str, unit: str, values: np.ndarray, like: np.ndarray | None = None) -> Variable:
    """Return the variable of a signal (n, K), or of constants of runs (n,), with knots as for values `like` others."""
    knots = place_knots(values if like is None else like)
    return Variable(name, unit, "between" if values.ndim == 1 else "curve", knots, values)


def own_variable(name: str, unit: str, like: np.ndarray, jumps: bool) -> Variable:
    """Return an own variable of a system whose values are `like` these (n, K)."""
    knots = place_knots(like)
    if jumps and knots[0] < 0 < knots[-1]:
        edge = EDGE * (knots[-1] - knots[0])
        apart = np.abs(knots) > 1e-3 * (knots[-1] - knots[0])
        knots = np.sort(np.concatenate([knots[apart], [-edge, edge]]))
    return Variable(name, unit, "own", knots, None, jumps)


def past(name: str, unit: str, values: np.ndarray, fine: int) -> Variable:
    """Return the variable of the plays, lags and relaxations of a signal (n, K) with `fine` instants in a sample."""
    size = float(np.ptp(values))
    knots = np.concatenate([WIDTHS * size, TIMES, np.tile(PLACES * size, len(RELAXATIONS))])
    return Variable(name, unit, "past", knots, values, fine=fine)


def lags(name: str, values: np.ndarray | None, fine: int, size: float) -> Variable:
    """Return the variable of the lags of a signal (n, K) of this `size`, or of the one that a part gives itself."""
    knots = np.concatenate([DELAYS, TIMES, np.tile(PLACES * size, len(RELAXATIONS))])
    return Variable(name, "samples", "lags", knots, values, fine=fine)


def place_knots(values: np.ndarray) -> np.ndarray:
    """Return knots (m,): at the levels if there are few, or else half way between quantiles and equal distances."""
    stride = max(1, values.size // _SAMPLE)
    while np.gcd(stride, values.shape[-1]) > 1 and stride > 1:  # so that all instants are among them
        stride += 1
    levels = np.unique(values.ravel()[::stride] if values.ndim == 2 else values)
    apart = levels[np.diff(levels, prepend=-np.inf) > EDGE * (levels[-1] - levels[0])]  # by more than rounding
    most = MOST if values.ndim == 2 else max(3, min(MOST, len(values) // _FEW_RUNS))
    if len(apart) <= min(MOST, most):
        return np.asarray(apart)
    ends = [OUTERMOST, 1 - OUTERMOST] if values.ndim == 2 else [0, 1]
    low, high = (float(end) for end in np.quantile(values, ends))
    even = np.linspace(low, high, most)
    quantiles = np.quantile(levels, np.linspace(float(ends[0]), float(ends[1]), most))
    return np.asarray(0.5 * (even + quantiles))


def divide(knots: np.ndarray, parts: int) -> np.ndarray:
    """Return knots (m,) and those between which divide each distance in so many parts, but for that of a jump."""
    first, distances = knots[:-1], np.diff(knots)
    wide = distances > 4 * EDGE * np.ptp(knots)
    return np.sort(np.concatenate([knots, *(first[wide] + distances[wide] * part / parts for part in range(1, parts))]))


def flat_forms(count: int) -> np.ndarray:
    """Return the coefficients (m, 2) of a constant and of a line; (1, 1) of a single one."""
    line = np.linspace(-1, 1, count)
    return np.stack([np.ones(count), line], axis=1)[:, :min(count, 2)]


@cache
def form_root(families: tuple[int, ...], walk: float, known_up_to: int = 0) -> np.ndarray:
    """Return L (m, r) with L L' the prior covariance of m coefficients of amplitude 1: constant, line, and walk.

    A law is known up to a number of flat forms that other parameters replace, and lacks these: nothing, the constant,
    or the constant and the line. Coefficients of several `families` are independent.
    """
    root = np.asarray(scipy.linalg.block_diag(*(_family_root(count, walk, known_up_to) for count in families)))
    root.setflags(write=False)  # all who ask share it
    return root


def _family_root(count: int, walk: float, known_up_to: int) -> np.ndarray:
    flat = flat_forms(count)
    free = flat[:, known_up_to:]
    if walk == 0 or count < 3:
        return free
    bent = np.cumsum(np.cumsum(np.eye(count)[:, 2:], axis=0), axis=0)
    bent = bent - flat @ np.linalg.lstsq(flat, bent, rcond=None)[0]
    return np.concatenate([free, walk * bent / np.sqrt((bent**2).sum(axis=1).mean())], axis=1)


@cache
def smooth_root(count: int, length: float) -> np.ndarray:
    """Return L (m, r) with L L' the correlation of a smooth curve at m equal distances.

    It falls off as a Gaussian of the standard deviation `length`, in these distances.
    """
    apart = np.subtract.outer(np.arange(count), np.arange(count)) / length
    values, axes = np.linalg.eigh(np.exp(-0.5 * apart**2))
    kept = values > 1e-9 * values[-1]
    root = np.asarray(axes[:, kept] * np.sqrt(values[kept]))
    root.setflags(write=False)
    return root


def lag(signal: np.ndarray, time: float) -> np.ndarray:
    """Return a signal (n, k) after a first-order lag of `time` samples."""
    signal = np.ascontiguousarray(signal, dtype=float)
    return np.asarray(signal + weigh_lags(signal, np.array([time]), np.ones(1)))


def late(signal: np.ndarray, by: float, every: int) -> np.ndarray:
    """Return each `every`-th sample of a signal (..., K) that is late by so many steps.

    By cubic convolution (Keys, IEEE Trans. Acoustics 29, 1153, 1981), whose slope has no jumps.
    """
    out = np.empty((*signal.shape[:-1], (signal.shape[-1] - 1) // every + 1))
    _fill_late(np.ascontiguousarray(signal).reshape(-1, signal.shape[-1]), float(by), every,
               out.reshape(-1, out.shape[-1]))
    return out


@njit(nogil=True, cache=True, error_model="numpy")
def weigh_bends(excess, knots, weights):  # type: ignore[no-untyped-def]
    """Return the weighted sum (n, k) of what an `excess` (n, k) is beyond each of `knots` (m,), 0 without excess."""
    out = np.zeros_like(excess)
    for i in range(excess.shape[0]):
        for t in range(excess.shape[1]):
            for m in range(len(knots)):
                out[i, t] += weights[m] * (max(excess[i, t] - knots[m], 0.0) - max(-knots[m], 0.0))
    return out


@njit(nogil=True, cache=True, error_model="numpy")
def slope_of_bends(excess, knots, weights):  # type: ignore[no-untyped-def]
    """Return the derivative (n, k) of `weigh_bends` with the excess."""
    out = np.zeros_like(excess)
    for i in range(excess.shape[0]):
        for t in range(excess.shape[1]):
            for m in range(len(knots)):
                if excess[i, t] > knots[m]:
                    out[i, t] += weights[m]
    return out


_LANES = 64
"""Columns that pass a lag together: each sample waits for the one before, and those of other columns do not."""


@njit(nogil=True, cache=True, error_model="numpy")
def respond_to_lags(change, delays, delayed, times, lagged, bends, out):  # type: ignore[no-untyped-def]
    """Fill out (n, m, K) with what dead times and lags with their weights leave of changes (n, m, K) of a signal.

    The last of `times` are those of `bends` (r, n, K), weights of what is not forgotten yet at a sample.
    """
    n, columns, size = change.shape
    keep, linear = np.exp(-1 / times), len(lagged)
    slope = times * (1 - keep)
    behind, rise, total = np.zeros((len(times), _LANES)), np.zeros(_LANES), np.empty(_LANES)
    for i in range(n):
        for first in range(0, columns, _LANES):
            count = min(_LANES, columns - first)
            behind[:] = 0.0  # what a lag is behind the signal
            for t in range(size):
                for g in range(count):
                    rise[g] = change[i, first + g, t] - change[i, first + g, max(t - 1, 0)]
                    total[g] = 0.0
                for m in range(len(times)):
                    weight = lagged[m] if m < linear else -bends[m - linear, i, t]
                    for g in range(count):
                        behind[m, g] = keep[m] * behind[m, g] - slope[m] * rise[g]
                        total[g] += weight * behind[m, g]
                for g in range(count):
                    out[i, first + g, t] = total[g]
    taps = _list_taps(delays, delayed)
    for i in range(n):
        for column in range(columns):
            _add_taps(change[i, column], taps, out[i, column])


@njit(nogil=True, cache=True, error_model="numpy")
def weigh_delays(signal, delays, weights):  # type: ignore[no-untyped-def]
    """Return the weighted sum (n, k) of what dead times `delays` (m,) leave of a signal (n, k)."""
    out, taps = np.zeros_like(signal), _list_taps(delays, weights)
    for i in range(len(signal)):
        _add_taps(signal[i], taps, out[i])
    return out


@njit(nogil=True, cache=True, error_model="numpy")
def _list_taps(delays, weights):  # type: ignore[no-untyped-def]
    """Return the weights of the sample after this one, of this one, and of those before it, of weighted dead times."""
    taps = np.zeros(int(np.floor(delays.max())) + 4)
    for m in range(len(delays)):
        whole = int(np.floor(delays[m]))
        first, second, third, fourth = _convolution_weights(delays[m] - whole)
        taps[whole + 3] += weights[m] * first
        taps[whole + 2] += weights[m] * second
        taps[whole + 1] += weights[m] * third
        taps[whole] += weights[m] * fourth
        taps[1] -= weights[m]
    return taps


@njit(nogil=True, cache=True, error_model="numpy")
def _add_taps(signal, taps, out):  # type: ignore[no-untyped-def]
    """Add a weighted sum of samples (K,) to out (K,); those before the first and behind the last are like these."""
    size = len(signal)
    for place in range(len(taps)):
        behind, weight = place - 1, taps[place]
        if weight == 0.0:
            continue
        for t in range(min(max(behind, 0), size)):
            out[t] += weight * signal[0]
        if behind < 0:
            out[size - 1] += weight * signal[size - 1]
        for t in range(max(behind, 0), min(size, size + behind)):
            out[t] += weight * signal[t - behind]


@njit(nogil=True, cache=True, error_model="numpy")
def _convolution_weights(by):  # type: ignore[no-untyped-def]
    """Return the weights of the samples -2, -1, 0 and 1 in a signal that is late by a part of a sample."""
    s = 1 - by  # share of the way from the sample before to this one
    return (-0.5 * s + s * s - 0.5 * s**3, 1 - 2.5 * s * s + 1.5 * s**3, 0.5 * s + 2 * s * s - 1.5 * s**3,
            -0.5 * s * s + 0.5 * s**3)


@njit(nogil=True, cache=True, error_model="numpy")
def _fill_late(signal, by, every, out):  # type: ignore[no-untyped-def]
    whole = int(np.floor(by))
    weights = _convolution_weights(by - whole)
    last = signal.shape[1] - 1
    first, second, third, fourth = weights
    begin = min(out.shape[1], max(0, (whole + 2 + every - 1) // every))  # samples that need no care of the ends
    end = max(begin, min(out.shape[1], (last + whole - 1) // every + 1))
    for i in range(len(signal)):
        for j in range(begin):
            out[i, j] = _interpolate(signal[i], every * j - whole, weights, last)
        for j in range(begin, end):
            behind = every * j - whole
            out[i, j] = (first * signal[i, behind - 2] + second * signal[i, behind - 1] + third * signal[i, behind]
                         + fourth * signal[i, behind + 1])
        for j in range(end, out.shape[1]):
            out[i, j] = _interpolate(signal[i], every * j - whole, weights, last)


@njit(nogil=True, cache=True, error_model="numpy")
def _interpolate(signal, behind, weights, last):  # type: ignore[no-untyped-def]
    total = 0.0
    for place in range(4):
        total += weights[place] * signal[min(max(behind - 2 + place, 0), last)]
    return total
