"""The nonlinear mixed-effects fit: each engagement has parameters of its own, normal about common means.

The algorithm of Lindstrom and Bates (Biometrics 46, 673, 1990) alternates: the engagements are linearised about their
own parameters, and the linear mixed model gives new means, variances and parameters of each engagement.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from slipstick.calibration import identification, noise, random_effects
from slipstick.calibration.linearised import Linearised, linearise
from slipstick.calibration.modes import FIRST, SHARES, axes, misfit, search_modes
from slipstick.calibration.noise import Noise
from slipstick.calibration.observations import Observations
from slipstick.calibration.random_effects import Engagements, RandomEffects

Report = Callable[[tuple[str, ...], int, float], None]
"""Callback after every iteration: names of the free parameters, iterations so far, largest change of a mean in standard
errors."""

_MOST = 40
CONVERGED = 0.02
"""Changes of all means, in standard errors, at which the fit ends: they widen no interval by more than 0.1 %."""
_HELD = 5
"""Most iterations with the scatter of the search. It is held until the means change by less than a standard error:
their error looks like scatter before. On the shipped recordings, whose effect the model lacks, 5 and 8 lead to the same
fit, and 2 to one at a bound."""
_FREE = 11
"""Iterations after which variances and noise move by half of the last share of the way, so that the fit ends where the
model is wrong, too: its residuals then depend on where an engagement is linearised, and noise and scatter on them."""
_INNER = 3  # alternations of variances and noise on one linearisation
_SPANS = 4
"""Linearisations until differences span what an engagement leaves open. After two, slopes along a direction in which no
signal changes at all still had errors that look like information: 0.04 to 5 times that of the bounds, in 24 to 30
engagements without pressure. After four it was below 0.01."""
_LEAST = 1e-4**2
"""Variance of a multiplier that the choice among shares of a step assumes at least, so that the penalty is finite."""


@dataclass(frozen=True, eq=False)
class MixedFit:
    """The `effects` found with the `noise`, the linearisation `about` them, and whether the means had `converged`.

    If it `is_partial`, the time ended before.
    """

    effects: RandomEffects
    noise: Noise
    about: Linearised
    iterations: int
    converged: bool
    is_partial: bool


def fit(observations: Observations, points: np.ndarray, sensors: Noise, scatter: np.ndarray,
        report: Report = lambda *_: None, end: float = np.inf) -> MixedFit:
    """Fit from `points` (n, d) and the standard deviations `scatter` (d,) on; `sensors` is the noise to start with.

    The first iteration after the time `end`, in s of the monotonic clock, is the last one.
    """
    variance = scatter**2
    points, about = search_modes(observations, points, variance, sensors)
    mean, change, iteration = np.median(points, axis=0), np.inf, 0
    # Misfit counts as noise before anything is estimated, or sensors' noise would make scatter of it.
    estimated = _estimate_noise(about, points, np.zeros_like(about.products[0, 0, :, :-1, :-1]), sensors)
    undetermined = _find_undetermined(observations, mean, variance, estimated)
    is_held = True
    while True:
        iteration += 1
        share = 0.5 ** max(0, iteration - _FREE)
        for _ in range(_INNER):
            linear = engagements(about, estimated, observations, undetermined)
            effects = (random_effects.predicted if is_held else random_effects.estimate)(linear, variance)
            variance = variance + share * (effects.variance - variance)
            estimated = estimated.move(_estimate_noise(about, effects.each, effects.posterior, sensors), share)
        effects = random_effects.predicted(engagements(about, estimated, observations, undetermined), variance)
        change = float(np.max(np.abs(effects.mean - mean) / effects.standard_error))
        report(observations.free, iteration, change)
        has_ended = not is_held and change < CONVERGED
        is_late = time.monotonic() > end
        if has_ended or iteration == _MOST or is_late:
            return MixedFit(effects, estimated, about, iteration, has_ended, is_late and not has_ended)
        is_held = is_held and iteration < _HELD and change > 1
        points = _move_points(observations, points, mean, effects, estimated)
        mean = effects.mean
        about = linearise(observations, points, axes(effects.posterior), float(sensors.std[-1]))


def engagements(about: Linearised, estimated: Noise, observations: Observations, held: np.ndarray) -> Engagements:
    """The linear mixed model of linearised engagements with a noise; its means are `held` in directions (d, q)."""
    weighted = about.weigh(estimated)
    information = weighted[:, :-1, :-1]
    pull = weighted[:, :-1, -1] + (information @ about.points[..., None])[..., 0]
    return Engagements(information, pull, *observations.bounds, observations.start, held)


def _find_undetermined(observations: Observations, point: np.ndarray, variance: np.ndarray,
                       estimated: Noise) -> np.ndarray:
    """The directions (d, q) that the engagements do not determine, all linearised about the same point (d,)."""
    points = np.tile(point, (len(observations.recordings), 1))
    steps = np.tile(FIRST * np.eye(len(point)), (len(points), 1, 1))
    for _ in range(_SPANS):
        about = linearise(observations, points, steps, estimated.std[-1])
        linear = engagements(about, estimated, observations, np.zeros((len(point), 0)))
        steps = axes(np.linalg.inv(linear.information + np.diag(1 / variance)))
    return identification.find_undetermined(random_effects.marginals(linear, variance)[0].sum(axis=0), linear.known)


def _estimate_noise(about: Linearised, each: np.ndarray, posterior: np.ndarray, sensors: Noise) -> Noise:
    """The noise that the residuals show at parameters `each` (n, d), with what these may be off.

    That of the shifting time is at least its sensor's: one value an engagement hardly tells it from scatter.
    """
    moved = np.concatenate([about.points - each, np.ones((len(about.points), 1))], axis=1)
    squares = np.einsum("np,ctnpq,nq->ct", moved, about.products, moved, optimize=True)
    squares += np.einsum("ctnpq,nqp->ct", about.products[..., :-1, :-1], posterior, optimize=True)
    shown = noise.fit_noise(squares, about.counts.sum(axis=2))
    return replace(shown, std=np.append(shown.std[:-1], max(shown.std[-1], sensors.std[-1])))


def _move_points(observations: Observations, points: np.ndarray, mean: np.ndarray, effects: RandomEffects,
                 estimated: Noise) -> np.ndarray:
    """New points (n, d) on the way from `points` about `mean` to the predicted ones, each as far as it fits best."""
    shares = np.append(SHARES, 0.0)[:, None, None]
    tried = points + shares * (np.clip(effects.each, *observations.bounds) - points)
    modes = tried - (mean + shares * (effects.mean - mean))
    penalty = (modes**2 / np.maximum(effects.variance, _LEAST)).sum(axis=2)
    best = (misfit(observations, tried, estimated, np.arange(len(points))) + penalty).argmin(axis=0)
    return np.asarray(tried[best, np.arange(len(points))])
