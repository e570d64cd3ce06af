"""What a law may be: functions of a variable, with a prior whose amplitude and smoothness are estimated.

A law is a P-spline (Eilers and Marx, Statistical Science 11, 89, 1996): hat functions in number, with the prior of an
integrated random walk, which is a penalty on second differences, beside a constant and a line of the same amplitude. Its
two hyperparameters, amplitude and share of the walk, are those of the largest marginal likelihood (Wood, J. R. Stat. Soc.
B 73, 3, 2011): no knots are chosen. The past of an input is weighted in the same way: what the input leaves after
mechanical plays, over their width, and after first-order lags, over their time.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy
from numba import njit
from scipy.signal import lfilter

from slipstick.engine.trajectory import EDGE, beside_jump

Kind = Literal["curve", "between", "own", "past", "lags"]

MOST = 30
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
WIDTHS, TIMES = np.geomspace(0.003, 0.5, 12), np.geomspace(0.5, 256, 14)
"""Of plays, over the range of the signal, and of lags in samples."""


@dataclass(frozen=True, eq=False)
class Variable:
    """What a law depends on, `name` in `unit`, with `knots` (m,).

    `values` are (n, K) of a "curve", (n,) of a law "between" runs, and the signal (n, K) whose "lags", or whose plays and
    lags (its "past"), are taken; an "own" variable has those of the system, and none here. `jumps` tells that an own variable is a switching state, over which a law may jump at 0. Values have `fine` instants in a
    sample.
    """

    name: str
    unit: str
    kind: Kind
    knots: np.ndarray
    values: np.ndarray | None = None
    jumps: bool = False
    fine: int = 1

    @property
    def families(self) -> tuple[int, ...]:
        """Numbers of coefficients whose order is that of a variable: each has a smooth prior of its own."""
        return (len(WIDTHS), len(TIMES)) if self.kind == "past" else (len(self.knots),)

    def coarse(self) -> "Variable":
        """Return the variable with few knots, for a first comparison."""
        count = len(self.knots)
        if self.kind not in ("curve", "own") or count <= COARSE:
            return self
        chosen = np.unique(np.round(np.linspace(0, count - 1, COARSE)).astype(int))
        if self.jumps:
            chosen = np.union1d(chosen, np.flatnonzero(np.abs(self.knots) <= 2 * EDGE * np.ptp(self.knots)))
        return replace(self, knots=self.knots[chosen])

    def basis(self, own: np.ndarray | None, size: int) -> np.ndarray:
        """Return the functions (n, m, K) of the variable, with the `own` values (n, K); (n, m, 1) between runs."""
        if self.kind == "own":
            assert own is not None
            x = np.asarray(own)
            return hats(beside_jump(x, np.sign(x), self.knots) if self.jumps else x, self.knots)
        values = own if self.values is None else self.values
        assert values is not None
        if self.kind in ("past", "lags"):
            count = len(WIDTHS) if self.kind == "past" else 0
            kept = [play(values, width) for width in self.knots[:count]]
            kept += [lag(values, time * self.fine) for time in self.knots[count:]]
            return np.stack(kept, axis=1) - values[:, None]
        return hats(values if values.ndim == 2 else values[:, None], self.knots)


def curve(name: str, unit: str, values: np.ndarray) -> Variable:
    """Return the variable of a signal (n, K), or of constants of runs (n,)."""
    return Variable(name, unit, "between" if values.ndim == 1 else "curve", place_knots(values), values)


def own_variable(name: str, unit: str, like: np.ndarray, jumps: bool) -> Variable:
    """Return an own variable of a system whose values are `like` these (n, K)."""
    knots = place_knots(like)
    if jumps and knots[0] < 0 < knots[-1]:
        edge = EDGE * (knots[-1] - knots[0])
        apart = np.abs(knots) > 1e-3 * (knots[-1] - knots[0])
        knots = np.sort(np.concatenate([knots[apart], [-edge, edge]]))
    return Variable(name, unit, "own", knots, None, jumps)


def past(name: str, unit: str, values: np.ndarray, fine: int) -> Variable:
    """Return the variable of the plays and lags of a signal (n, K) with `fine` instants in a sample."""
    return Variable(name, unit, "past", np.concatenate([WIDTHS * np.ptp(values), TIMES]), values, fine=fine)


def lags(name: str, values: np.ndarray | None, fine: int) -> Variable:
    """Return the variable of the lags of a signal (n, K), or of the one that a part gives itself."""
    return Variable(name, "samples", "lags", TIMES, values, fine=fine)


def place_knots(values: np.ndarray) -> np.ndarray:
    """Return knots (m,): at the levels if there are few, or else half way between quantiles and equal distances."""
    stride = max(1, values.size // _SAMPLE)
    while np.gcd(stride, values.shape[-1]) > 1 and stride > 1:  # so that all instants are among them
        stride += 1
    levels = np.unique(values.ravel()[::stride] if values.ndim == 2 else values)
    most = MOST if values.ndim == 2 else max(3, min(MOST, len(values) // _FEW_RUNS))
    if len(levels) <= min(MOST, most):
        return levels
    ends = [OUTERMOST, 1 - OUTERMOST] if values.ndim == 2 else [0, 1]
    even = np.linspace(*np.quantile(values, ends), most)
    quantiles = np.quantile(levels, np.linspace(*ends, most))
    return np.asarray(0.5 * (even + quantiles))


def hats(x: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Return hat functions (n, m, k) of x (n, k) at knots (m,), constant beyond the outermost ones."""
    out = np.zeros((len(x), len(knots), x.shape[1]))
    _fill_hats(np.ascontiguousarray(x, dtype=float), knots, out)
    return out


def flat_forms(count: int) -> np.ndarray:
    """Return the coefficients (m, 2) of a constant and of a line; (1, 1) of a single one."""
    line = np.linspace(-1, 1, count)
    return np.stack([np.ones(count), line], axis=1)[:, :min(count, 2)]


def form_root(families: tuple[int, ...], walk: float, known_up_to: int = 0) -> np.ndarray:
    """Return L (m, r) with L L' the prior covariance of m coefficients of amplitude 1: constant, line, and walk.

    A law is known up to a number of flat forms that other parameters replace, and lacks these: nothing, the constant,
    or the constant and the line. Coefficients of several `families` are independent.
    """
    return np.asarray(scipy.linalg.block_diag(*(_family_root(count, walk, known_up_to) for count in families)))


def _family_root(count: int, walk: float, known_up_to: int) -> np.ndarray:
    flat = flat_forms(count)
    free = flat[:, known_up_to:]
    if walk == 0 or count < 3:
        return free
    bent = np.cumsum(np.cumsum(np.eye(count)[:, 2:], axis=0), axis=0)
    bent = bent - flat @ np.linalg.lstsq(flat, bent, rcond=None)[0]
    return np.concatenate([free, walk * bent / np.sqrt((bent**2).sum(axis=1).mean())], axis=1)


def smooth_root(count: int, length: float) -> np.ndarray:
    """Return L (m, r) with L L' the correlation of a smooth curve at m equal distances.

    It falls off as a Gaussian of the standard deviation `length`, in these distances.
    """
    apart = np.subtract.outer(np.arange(count), np.arange(count)) / length
    values, axes = np.linalg.eigh(np.exp(-0.5 * apart**2))
    kept = values > 1e-9 * values[-1]
    return np.asarray(axes[:, kept] * np.sqrt(values[kept]))


@njit(nogil=True, cache=True, error_model="numpy")
def _fill_hats(x, knots, out):  # type: ignore[no-untyped-def]
    last = len(knots) - 1
    for i in range(x.shape[0]):
        j = 0
        for t in range(x.shape[1]):
            value = x[i, t]
            if value <= knots[0] or last == 0:
                out[i, 0, t] = 1.0
                continue
            if value >= knots[last]:
                out[i, last, t] = 1.0
                continue
            while j > 0 and knots[j] > value:
                j -= 1
            while knots[j + 1] <= value:
                j += 1
            share = (value - knots[j]) / (knots[j + 1] - knots[j])
            out[i, j, t] = 1.0 - share
            out[i, j + 1, t] = share


@njit(nogil=True, cache=True)
def play(signal, width):  # type: ignore[no-untyped-def]
    """Return a signal (n, k) after a mechanical play of half-width `width`."""
    out = np.empty_like(signal)
    for i in range(len(signal)):
        here = signal[i, 0]
        for j in range(signal.shape[1]):
            here = min(max(here, signal[i, j] - width), signal[i, j] + width)
            out[i, j] = here
    return out


def lag(signal: np.ndarray, time: float) -> np.ndarray:
    """Return a signal (n, k) after a first-order lag of `time` samples."""
    keep = np.exp(-1 / time)
    return np.asarray(lfilter([1 - keep], [1, -keep], signal, axis=1, zi=keep * signal[:, :1])[0])
