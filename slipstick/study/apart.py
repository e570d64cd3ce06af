"""How far two fitted models predict apart in one engagement, beyond what noise and scatter from run to run can hide.

What the one would give is taken for measured, and the scatter of the other refitted to it. The difference r that is
left, under the covariance V of noise and scatter, tells them apart: such a run is expected to raise the log-likelihood
of the right model above the other's by r' V^-1 r / 2, with a variance of r' V^-1 r.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from slipstick.bench.conditions import Conditions
from slipstick.clutch import ensemble
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.processing import block_means
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.study.climb import RIDGE, Limits
from slipstick.study.comparison import BLIND, WIDTH, Comparison
from slipstick.study.linearised import linearise
from slipstick.study.marginal import marginal, rarity, spread
from slipstick.study.mixed import MixedFit

_SURE, _MOST = 5.0, 1000
"""Standard errors by which repetitions shall tell two models apart, and the most of them that help anybody."""
_REFITS, _REACH = 6, 0.1
"""Gauss-Newton steps to the scatter of an engagement, and the longest: ties come to rest in three or four."""
_DRAWS = 32  # of the scatter of a run


@dataclass(frozen=True, eq=False)
class Apart:
    """`modes` (n, q) of the scatter after the refit, and the `squares` (channels + 1, n) that are left, r' V^-1 r.

    Those of each channel in units of its noise and, last, of the modes in units of the scatter.
    """

    modes: np.ndarray
    squares: np.ndarray


def locks(model: MixedFit, conditions: Conditions, modes: np.ndarray) -> np.ndarray:
    """Whether each engagement of the fitted model comes to a lock-up, (n,), with the scatter `modes` (n, q)."""
    response = ensemble.simulate(model.design.bench.physics.curves, *_points(model, modes), conditions, paired=True,
                                 laws=model.design.laws)
    return np.asarray(response.status == ensemble.LOCKED)


def ideal(comparison: Comparison, model: MixedFit, conditions: Conditions, modes: np.ndarray) -> Comparison:
    """What would be recorded without noise if a fit were right, with the scatter `modes` (n, q), where all lock."""
    recorded = comparison.recordings.signals
    time = None if recorded is None else recorded.time
    response = ensemble.simulate(model.design.bench.physics.curves, *_points(model, modes), conditions, time,
                                 paired=True, laws=model.design.laws)
    signals = None if time is None else Signals(time, *(getattr(response, name) for name in SIGNAL_UNITS))
    blank = replace(comparison, recordings=Recordings(conditions, response.shifting_time, signals))
    values = blank.predicted(response)
    return replace(blank, measured=values, weights=np.ones_like(values))


def beside(right: Comparison, other: Comparison) -> Comparison:
    """`right` but for the torque between its lock-up and the other's: the shifting times tell how far these differ."""
    time, weights = right.times, right.weights.copy()
    if time is not None:
        first, last = np.sort([right.measured[:, -1:], other.measured[:, -1:]], axis=0)
        centre = block_means(time, WIDTH)
        blind = BLIND * (centre[1] - centre[0])
        weights[:, right.channels["output_torque"]] = (centre < first - blind) | (centre > last + blind)
    return replace(right, weights=weights)


def apart(right: Comparison, model: MixedFit, modes: np.ndarray) -> Apart:
    """Refit the scatter of a model, from `modes` (n, q), to what `right` would give, engagement by engagement."""
    places = list(model.design.scattering)
    best = Apart(modes, np.full((len(right.channels) + 1, len(modes)), np.inf))
    state, step = replace(model.state, modes=modes), np.zeros_like(modes)
    for _ in range(_REFITS):
        about = linearise(right, model.design, spread(state, model.design.scattering), columns=places)
        squares = np.vstack([about.gram[:, :, -1, -1] / state.noise[:, None], rarity(state.modes, state.covariance)])
        better = squares.sum(axis=0) < best.squares.sum(axis=0)
        best = Apart(np.where(better[:, None], state.modes, best.modes), np.where(better, squares, best.squares))
        aim = marginal(about, state, tuple(range(len(places)))).score @ state.covariance
        # A step that leads uphill was too long: the valley of pressure bias and initial position is curved.
        step = np.where(better[:, None], np.clip(aim - state.modes, -_REACH, _REACH), step / 4)
        state = replace(state, modes=best.modes + step)
    return best


def repetitions(comparison: Comparison, right: MixedFit, model: MixedFit, condition: Conditions, modes: np.ndarray,
                seed: int) -> int | None:
    """Runs of one engagement after which a model, refitted to old and new runs, trails by five standard errors.

    `modes` (1, q) are those of `apart`. The runs are drawn with the scatter of the `right` one, as much as lets both
    lock: how much each tells varies with it. None where a thousand are too few.
    """
    drawn = np.random.default_rng(seed).standard_normal((_DRAWS // 2, modes.shape[1]))
    drawn = np.concatenate([drawn, -drawn]) @ np.linalg.cholesky(right.state.covariance).T
    runs = condition.take(np.zeros(_DRAWS, int))
    some = np.flatnonzero(locks(right, runs, drawn) & locks(model, runs, drawn + modes))
    if not len(some):
        return None
    runs, drawn, moved = runs.take(some), drawn[some], drawn[some] + modes
    there = beside(ideal(comparison, right, runs, drawn), ideal(comparison, model, runs, moved))
    found = apart(there, model, moved)
    state = replace(model.state, modes=found.modes)
    about = linearise(there, model.design, spread(state, model.design.scattering))
    run = marginal(about, state, model.design.scattering)
    gain = 0.5 * (found.squares.sum(axis=0) - rarity(drawn, right.state.covariance))
    known = model.marginal.information.sum(axis=0) + np.diag(Limits.of(model.design).precision + RIDGE)
    values, vectors = eigh(run.information.mean(axis=0), known)
    times = np.arange(1, _MOST + 1)
    yielded = (times[:, None] * (vectors.T @ run.score.mean(axis=0))) ** 2 / (1 + times[:, None] * values.clip(0.0))
    ahead = times * gain.mean() - 0.5 * yielded.sum(axis=1)
    enough = np.flatnonzero(ahead >= _SURE * np.sqrt(times * (found.squares[:-1].sum(axis=0).mean() + gain.var())))
    return int(times[enough[0]]) if len(enough) and gain.mean() > 0 else None


def _points(model: MixedFit, modes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return model.design.vectors(spread(replace(model.state, modes=modes), model.design.scattering))
