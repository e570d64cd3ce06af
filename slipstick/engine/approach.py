"""Where a fit begins again: at parameters of each run by itself, by steps that are damped in each run apart.

Steps of all runs together go too far in some of them, which then end at another optimum: a body that meets another one,
or comes to rest, responds suddenly. The damping of a run follows its own gains (Levenberg, Quart. Appl. Math. 2, 164,
1944; Marquardt, J. SIAM 11, 431, 1963). Runs that are left behind are like the others, whose parameters tell where to
look: they begin again at the most likely one of many draws from these.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slipstick.engine.fit import begin
from slipstick.engine.laws import Candidate
from slipstick.engine.model import State
from slipstick.engine.part_fit import PartFit, fit_part
from slipstick.engine.products import assemble
from slipstick.engine.recordings import Pair, Recorded

_STEPS, _TRIALS, _AGAIN = 10, 4, 2
"""Most steps, most trials of each, and times that the worse half of the runs begins again."""
_DRAWS, _WIDER = 64, 1.5
"""Points that are drawn for a run, and their spread over that of the others: these may be too much alike."""
_LEAST = 1e-12
"""Least variance of what is drawn, in the scale of a parameter: others may all have the same one."""
_DAMPED, _LESS, _MORE = 1e-2, 0.2, 10.0
"""Damping to begin with, over the information on a parameter, and its factors after a gain and after a loss."""
_GAINED = 2.0
"""Mean gain of a run in squares below which steps end: the fit of all runs together goes on from there."""


def approach(recorded: Recorded) -> tuple[State, np.ndarray]:
    """Return a state without laws at which each run by itself is likely, and the squares (n,) that it leaves, over the
    samples.

    The prior of a parameter is its largest scatter about the nominal value.
    """
    state, left = _descend(recorded, {}, begin(recorded))
    random = np.random.default_rng(0)
    for _ in range(_AGAIN):
        worse = left > np.median(left)
        if not worse.any():
            break
        taken = recorded.take(np.flatnonzero(worse))
        again, reached = _descend(taken, {}, _draw(taken, state.take(worse), state.points[~worse], random))
        is_better = reached < left[worse]
        points = state.points.copy()
        points[worse] = np.where(is_better[:, None], again.points, points[worse])
        left[worse] = np.where(is_better, reached, left[worse])
        state = replace(state, points=points)
    return replace(state, means=state.points.mean(axis=0)), left


def approach_each(recorded: Recorded, laws: Mapping[Pair, Candidate], state: State) -> State:
    """Return a state with points of each run by itself, where means, shared values and laws are kept."""
    return _descend(recorded, laws, state)[0]


def _draw(recorded: Recorded, state: State, others: np.ndarray, random: np.random.Generator) -> State:
    """Return the state with the most likely ones of points that are drawn like those of other runs (m, r)."""
    n, count = state.points.shape
    middle = np.tile(np.median(others, axis=0), (n, 1))
    models = [fit_part(recorded, part, replace(state, points=middle), {}) for part in recorded.parts]
    spread = _WIDER * np.linalg.cholesky(np.cov(others, rowvar=False) + _LEAST * np.eye(count))
    best, points = np.full(n, np.inf), middle
    for number in range(_DRAWS):
        drawn = middle + (random.standard_normal((n, count)) @ spread.T if number else 0.0)
        squares = np.sum([model.move(replace(state, points=drawn)).gram[:, -1, -1] for model in models], axis=0)
        gains = squares < best
        best, points = np.where(gains, squares, best), np.where(gains[:, None], drawn, points)
    return replace(state, points=points)


def _descend(recorded: Recorded, laws: Mapping[Pair, Candidate], state: State) -> tuple[State, np.ndarray]:
    """Return the state after damped steps, and the squares (n,) that it leaves, over the number of samples."""
    n, random = len(recorded), len(recorded.random)
    precision = 1 / recorded.widest**2
    samples = np.maximum(np.sum([part.counted.sum(axis=(1, 2)) for part in recorded.parts], axis=0), 1)
    damping = np.full(n, _DAMPED)

    def weigh(models: Mapping[str, PartFit], points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return information (n, r, r), pull (n, r) and squares (n,) of models at points (n, r)."""
        values = assemble(recorded, models, {}, replace(state, points=points)).values
        with np.errstate(all="ignore"):  # infinite squares of a run are no step of it
            left = np.concatenate([-points, np.tile(-state.shared, (n, 1)), np.ones((n, 1))], axis=1)
            against = (values @ left[:, :, None])[:, :, 0]
            squares = (left * against).sum(axis=1) + (points - state.means) ** 2 @ precision
        is_finite = np.isfinite(values).all(axis=(1, 2)) & np.isfinite(squares)
        information = np.where(is_finite[:, None, None], values[:, :random, :random], 0) + np.diag(precision)
        pull = np.where(is_finite[:, None], against[:, :random] - precision * (points - state.means), 0)
        return information, pull, np.where(is_finite, squares, np.inf)

    for _ in range(_STEPS):
        models = {part.name: fit_part(recorded, part, state, laws, is_fixed=True) for part in recorded.parts}
        information, pull, before = weigh(models, state.points)
        after = before
        for _ in range(_TRIALS):
            waiting = after == before  # runs that have made no step yet
            damped = information * (1 + damping[:, None, None] * np.eye(random))
            there = np.where(waiting[:, None], state.points + np.linalg.solve(damped, pull[:, :, None])[:, :, 0],
                             state.points)
            moved = {name: model.move(replace(state, points=there)) for name, model in models.items()}
            _, _, reached = weigh(moved, there)
            gains = waiting & (reached < before)
            state = replace(state, points=np.where(gains[:, None], there, state.points))
            after = np.where(gains, reached, after)
            damping = np.where(gains, _LESS * damping, np.where(waiting, _MORE * damping, damping))
            if gains.sum() * 2 >= waiting.sum():
                break
        if np.mean(np.where(np.isfinite(before), before - after, 0)) < _GAINED:
            break
    return state, after / samples
