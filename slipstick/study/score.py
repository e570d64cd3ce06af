"""Which effects the residuals ask for: efficient scores of all candidates at a fitted model, one number an experiment.

An experiment is one observation. The statistic of a candidate is the square of its summed scores over the variance
that they show from experiment to experiment (cluster-robust score test: Boos, American Statistician 46, 327, 1992),
and the largest over all candidates is held against its distribution in replicates simulated from the fitted model,
in which the scatter remembers from run to run what it does in the recordings.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from slipstick.bench import Bench
from slipstick.clutch import effects
from slipstick.study.comparison import Comparison
from slipstick.study.linearised import Probe, linearise
from slipstick.study.marginal import Marginal, marginal
from slipstick.study.mixed import MixedFit

_STEP = 0.1
"""Of a probe, in typical values."""
_SHAPES = 3
"""Values of a shape coefficient that are tried, evenly in logarithms, its typical one between them."""
_WANDERING = 0.9
"""Memory from run to run that scatter is granted before a drift is named: a wandering of some runs looks like one."""
REPLICATES = 999
_HALVES = 200
_AT_ONCE = 50


@dataclass(frozen=True, eq=False)
class Scores:
    """For each of the c `probes`: efficient scores of n experiments `each` (n, c) and their `information` (c,).

    `gain` (c,) is what the log-likelihood would rise by, `estimate` (c,) the coefficient where it would be greatest,
    in typical values, both in linear approximation; `kept` (c,) the share of the probe's signature that a refit of
    everything else leaves, `seen` (c,) the share of its square that the scatter leaves. `p_values` (c,) are the shares
    of replicates in which the largest of all statistics is as large, among drifts and among all others: that of the
    largest holds for the search as a whole. A drift's is twice the smaller of two: beside scatter that wanders, and
    with a trend of the scatter taken out.
    """

    probes: tuple[Probe, ...]
    each: np.ndarray
    information: np.ndarray
    kept: np.ndarray
    seen: np.ndarray
    p_values: np.ndarray

    @property
    def statistic(self) -> np.ndarray:
        """Cluster-robust score statistics, (c,)."""
        return statistic(self.each)

    @property
    def gain(self) -> np.ndarray:
        """Rise of the natural log-likelihood in linear approximation, (c,)."""
        return np.asarray(0.5 * self.each.sum(axis=0) ** 2 / self.information)

    def selected(self, seed: int) -> np.ndarray:
        """How often each probe promises most in random halves of the experiments, (c,): stability selection.

        Meinshausen and Buhlmann, J. R. Statist. Soc. B 72, 417, 2010, in complementary pairs of halves (Shah and
        Samworth, ibid. 75, 55, 2013).
        """
        rng, n = np.random.default_rng(seed), len(self.each)
        first = np.array([rng.permutation(n) < n // 2 for _ in range(_HALVES // 2)])
        sums = np.concatenate([first, ~first]) @ self.each
        wins = (sums**2 / self.information).argmax(axis=1)
        return np.asarray(np.bincount(wins, minlength=len(self.information)) / len(sums))

    @property
    def estimate(self) -> np.ndarray:
        """Coefficients in typical values, (c,), in linear approximation."""
        return np.asarray(self.each.sum(axis=0) / self.information)


def statistic(each: np.ndarray) -> np.ndarray:
    """Squared sum over the spread about the mean, of scores (..., n, c): (..., c)."""
    centred = each - each.mean(axis=-2, keepdims=True)
    spread = (centred**2).sum(axis=-2)
    return np.asarray(each.sum(axis=-2) ** 2 / np.where(spread > 0, spread, np.inf))


def probes(catalogue: Sequence[str], bench: Bench) -> tuple[Probe, ...]:
    """First moves of every amplitude of the effects named, at several values of a shape coefficient, on a bench."""
    found = []
    for name in catalogue:
        effect = effects.find(name).on(bench.scales)
        amplitudes = [one for one in effect.coefficients if not one.shape]
        shapes: list[tuple[tuple[str, float], ...]] = [()]
        names = [one.name for one in effect.coefficients if one.shape]
        if effect.forms:
            shapes = [tuple(zip(names, form, strict=True)) for form in effect.forms]
        for one in effect.coefficients:
            if one.shape and not effect.forms:
                values = np.geomspace(one.typical / _spread(one), one.typical * _spread(one), _SHAPES)
                shapes = [(*before, (one.name, float(value))) for before in shapes for value in values]
        found += [Probe(name, one.name, one.typical, _inwards(one), shape) for one in amplitudes for shape in shapes]
    return tuple(found)


def score(comparison: Comparison, found: MixedFit, catalogue: Sequence[str], seed: int) -> Scores:
    """Score the effects `catalogue` at a fit."""
    tried = probes(catalogue, comparison.bench)
    about = linearise(comparison, found.design, found.points, tried)
    integrated = marginal(about, found.state, found.design.scattering)
    p = len(found.state.theta)
    onto, information, kept = _efficient(integrated, p)
    each = _projected(integrated, onto)
    runs = comparison.recordings.run_order
    order = np.arange(len(each)) if runs is None else np.argsort(runs)
    drifts = np.array([effects.find(one.effect).uses_run_order for one in tried])

    def shares(onto: np.ndarray, memory: float) -> np.ndarray:
        """Of replicates in which the largest statistic is as large as each of those along `onto` (n, m, c), (c,)."""
        largest = _replicates(integrated, found, onto, order, memory, seed)
        larger = (largest[:, None] >= statistic(_projected(integrated, onto))).sum(axis=0)
        return np.asarray((1 + larger) / (1 + REPLICATES))

    memory, p_values = remembered(found, runs), np.ones(len(tried))
    if not drifts.all():
        p_values[~drifts] = shares(onto[:, :, ~drifts], memory)
    if drifts.any():
        # Scatter that wanders looks like a drift. Two ways to allow for it, and the price of having two.
        trend = _trend(order, found.design.scattering, p + len(tried))
        apart = _efficient(integrated, p, trend)[0]
        either = [shares(onto[:, :, drifts], max(memory, _WANDERING)), shares(apart[:, :, drifts], memory)]
        p_values[drifts] = np.minimum(1.0, 2 * np.min(either, axis=0))
    square = np.einsum("nmm->m", about.weighted(found.state.noise))[p:-1]
    seen = np.einsum("nmm->m", integrated.information)[p:] / np.maximum(square, 1e-12)
    return Scores(tried, each, information, kept, seen, p_values)


def _projected(integrated: Marginal, onto: np.ndarray) -> np.ndarray:
    """Scores (n, c) of each experiment along its combinations `onto` (n, m, c)."""
    return np.asarray(np.einsum("nm,nmc->nc", integrated.score, onto))


def _trend(order: np.ndarray, scattering: tuple[int, ...], m: int) -> np.ndarray:
    """Moves (n, m, q) of the scattering entries along with the place in the `order` (n,) of the runs, -1 to 1."""
    along = np.linspace(-1, 1, len(order))[np.argsort(order)]
    moves = np.zeros((len(order), m, len(scattering)))
    moves[:, scattering] = along[:, None, None] * np.eye(len(scattering))
    return moves


def _efficient(integrated: Marginal, p: int,
               more: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What a refit leaves of c probes: combinations (n, m, c) of the m scores, their information, and the share left.

    The refit moves theta, the first p entries, and what else is in `more` (n, m, q).
    """
    n, m = integrated.score.shape
    moves = np.zeros((n, m, p))
    moves[:, :p] = np.eye(p)
    if more is not None:
        moves = np.concatenate([moves, more], axis=2)
    pulled = integrated.information @ moves
    nuisance = np.einsum("nmp,nmr->pr", moves, pulled, optimize=True)
    nuisance += 1e-9 * np.diag(np.diag(nuisance) + 1e-9)
    onto = -moves @ np.linalg.solve(nuisance, pulled[:, p:].sum(axis=0).T)
    onto[:, p:] += np.eye(m - p)
    whole = np.einsum("nmm->m", integrated.information)[p:]
    left = np.einsum("nmc,nmr,nrc->c", onto, integrated.information, onto, optimize=True)
    floor = np.maximum(left, 1e-9 * whole + 1e-12)
    return onto, floor, np.sqrt(floor / np.maximum(whole, 1e-12))


def _replicates(integrated: Marginal, found: MixedFit, onto: np.ndarray, order: np.ndarray, memory: float,
                seed: int) -> np.ndarray:
    """The largest statistic of each of `REPLICATES` sets of experiments drawn from the fitted model.

    In `order` (n,) of the runs the scatter follows a first-order autoregression of coefficient `memory`.
    """
    rng = np.random.default_rng(seed)
    places, covariance = list(found.design.scattering), found.state.covariance
    turned = onto.transpose(0, 2, 1)
    along = turned @ integrated.information[:, :, places]  # scores per unit of each mode, (n, c, q)
    noise = turned @ integrated.information @ onto - along @ covariance @ along.transpose(0, 2, 1)
    values, vectors = np.linalg.eigh(noise)
    root = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    n, c = root.shape[:2]
    spread, largest = np.linalg.cholesky(covariance), []
    for _ in range(0, REPLICATES, _AT_ONCE):
        modes = np.empty((n, len(places), _AT_ONCE))
        modes[order] = np.einsum("qr,nrk->nqk", spread, autoregression(rng, (n, len(places), _AT_ONCE), memory))
        drawn = root @ rng.standard_normal((n, c, _AT_ONCE)) + along @ modes
        largest.append(statistic(drawn.transpose(2, 0, 1)).max(axis=1))
    return np.concatenate(largest)[:REPLICATES]


def autoregression(rng: np.random.Generator, shape: tuple[int, ...], memory: float) -> np.ndarray:
    """Draws of unit variance, each of which remembers `memory` of the one before it along the first axis."""
    fresh = rng.standard_normal(shape)
    fresh[1:] *= np.sqrt(1 - memory**2)
    return np.asarray(lfilter([1.0], [1.0, -memory], fresh, axis=0))


def remembered(found: MixedFit, order: np.ndarray | None) -> float:
    """How much of the scatter a run has in common with the run before, a trend apart: 0 to 0.97.

    Of the combination of modes that the recordings determine best, with the bias of the estimate beside a trend
    (Marriott and Pope, Biometrika 41, 390, 1954) added back.
    """
    if order is None:
        return 0.0
    n, places = len(order), list(found.design.scattering)
    root = np.linalg.cholesky(found.state.covariance)
    gram = found.about.weighted(found.state.noise).sum(axis=0)[places][:, places]
    best = np.linalg.eigh(root.T @ gram @ root)[1][:, -1]
    series = (found.state.modes @ np.linalg.inv(root).T @ best)[np.argsort(order)]
    place = np.linspace(-1, 1, n)
    left = series - np.polynomial.Polynomial.fit(place, series, 1)(place)
    shared = float((left[1:] * left[:-1]).sum() / (left**2).sum())
    return float(np.clip(shared + (2 + 4 * shared) / n, 0.0, 0.97))


def _spread(one: effects.Coefficient) -> float:
    """How far on either side of its typical value a shape coefficient is tried, as a factor."""
    return min(3.0, one.upper / one.typical, one.typical / max(one.lower, 1e-12))


def _inwards(one: effects.Coefficient) -> float:
    """The step of a probe: away from a bound at which the neutral value lies."""
    return _STEP if one.neutral + _STEP * one.typical <= one.upper else -_STEP
