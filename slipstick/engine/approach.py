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
_DAMPED, _LESS, _MORE = 1e-2, 0.2, 10.0
"""Damping to begin with, over the information on a parameter, and its factors after a gain and after a loss."""
_GAINED = 2.0
"""Mean gain of a run in squares below which steps end: the fit of all runs together goes on from there."""


def approach(recorded: Recorded, laws: Mapping[Pair, Candidate] | None = None, state: State | None = None) -> tuple[State, np.ndarray]:
    """Return a state at which each run by itself is likely, and the squares (n,) that it leaves, over the samples.

    Laws are as they are in a state to begin with.

    The prior of a parameter is its largest scatter about the mean, or about the nominal value.
    """
    laws = laws or {}
    state, left = _descend(recorded, laws, state or begin(recorded))
    random = np.random.default_rng(0)
    for _ in range(_AGAIN):
        worse = left > np.median(left)
        if not worse.any():
            break
        rows = np.flatnonzero(worse)
        taken, of_rows = recorded.take(rows), {pair: law.take(rows) for pair, law in laws.items()}
        drawn = _draw(taken, of_rows, state.take(rows), state.points[~worse], random)
        again, reached = _descend(taken, of_rows, drawn)
        is_better = reached < left[worse]
        points = state.points.copy()
        points[worse] = np.where(is_better[:, None], again.points, points[worse])
        left[worse] = np.where(is_better, reached, left[worse])
        state = replace(state, points=points)
    return replace(state, means=state.points.mean(axis=0)), left


def approach_each(recorded: Recorded, laws: Mapping[Pair, Candidate], state: State) -> State:
    """Return the state with points of each run by itself, where means, shared values and laws are kept."""
    return _descend(recorded, laws, state)[0]


def _draw(recorded: Recorded, laws: Mapping[Pair, Candidate], state: State, others: np.ndarray,
          random: np.random.Generator) -> State:
    """Return the state with the most likely ones of points that are drawn like those of other runs (m, r)."""
    n, count = state.points.shape
    begins = replace(state, points=np.tile(np.median(others, axis=0), (n, 1)))
    models = {part.name: fit_part(recorded, part, begins, laws) for part in recorded.parts}
    spread = np.linalg.cholesky(np.cov(others, rowvar=False) + 1e-12 * np.eye(count))
    best, points = np.full(n, np.inf), begins.points
    for number in range(_DRAWS):
        drawn = begins.points + (number > 0) * _WIDER * random.standard_normal((n, count)) @ spread.T
        squares = sum(model.move(replace(begins, points=drawn)).gram[:, -1, -1] for model in models.values())
        gains = squares < best
        best, points = np.where(gains, squares, best), np.where(gains[:, None], drawn, points)
    return replace(state, points=points)


def _descend(recorded: Recorded, laws: Mapping[Pair, Candidate], state: State) -> tuple[State, np.ndarray]:
    """Return the state after damped steps, and the squares (n,) that it leaves, over the number of samples."""
    n, random = len(recorded), len(recorded.random)
    fixed = np.concatenate([state.shared, *(state.laws[pair] for pair in laws)])
    precision = np.array([1 / term.widest**2 for term in recorded.random])
    samples = np.maximum(np.sum([part.counted.sum(axis=(1, 2)) for part in recorded.parts], axis=0), 1)
    damping = np.full(n, _DAMPED)

    def weigh(models: Mapping[str, PartFit], points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return information (n, r, r), pull (n, r) and squares (n,) of models at points (n, r)."""
        values = assemble(recorded, models, laws, replace(state, points=points)).values
        with np.errstate(all="ignore"):  # infinite squares of a run are no step of it
            left = np.concatenate([-points, np.tile(-fixed, (n, 1)), np.ones((n, 1))], axis=1)
            against = (values @ left[:, :, None])[:, :, 0]
            squares = (left * against).sum(axis=1) + (points - state.means) ** 2 @ precision
        is_finite = np.isfinite(values).all(axis=(1, 2)) & np.isfinite(squares)
        information = np.where(is_finite[:, None, None], values[:, :random, :random], 0) + np.diag(precision)
        pull = np.where(is_finite[:, None], against[:, :random] - precision * (points - state.means), 0)
        return information, pull, np.where(is_finite, squares, np.inf)

    for _ in range(_STEPS):
        models = {part.name: fit_part(recorded, part, state, laws) for part in recorded.parts}
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
