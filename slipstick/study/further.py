"""Which further experiments would tell effects apart that these recordings do not."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.study.apart import apart, beside, ideal, locks, repetitions
from slipstick.study.comparison import Comparison
from slipstick.study.mixed import MixedFit

_FACTORS = ("motor_speed", "load_inertia", "brake_torque")
_BEYOND = (0.8, 1.2)
"""Times the lowest and the highest recorded level: as far as a fit may be trusted unseen. A ratio keeps every factor
positive, and is a step also where only one level was recorded."""
_LEVELS, _ENGAGEMENTS = 4, 1000  # recorded levels of a factor, and combinations, that are tried at most
_BEST = 5  # experiments that are told


def further(comparison: Comparison, fits: Sequence[MixedFit], seed: int) -> list[dict[str, Any]]:
    """The experiments in which, were the first of the fits right, the one of the others that is nearest misses most.

    Each as JSON: `current_profile`, `motor_speed` in rad/s, `load_inertia` in kg m^2, `brake_torque` in N m; whether it
    was `recorded`; how far `apart` the two are, RMS over the compared values in noise levels; the `signal` that tells
    most of it; and the `repetitions` after which the first is ahead by five standard errors, or None where a thousand
    are too few. The best of each current profile and motor speed, and the best that was recorded, for a bench that
    cannot go further.
    """
    first, *others = fits
    conditions = tried(comparison.recordings.conditions, seed)
    # What slips to the end of its profile in one of the models has no shifting time, and is no experiment.
    still = np.zeros((len(conditions), len(first.design.scattering)))
    places = np.flatnonzero(np.all([locks(one, conditions, still) for one in fits], axis=0))
    if not len(places):
        return []
    conditions, still = conditions.take(places), still[places]
    right = ideal(comparison, first, conditions, still)
    rights = [beside(right, ideal(comparison, one, conditions, still)) for one in others]
    found = [apart(its, one, still) for its, one in zip(rights, others, strict=True)]
    distance = np.array([np.sqrt(one.squares.sum(axis=0) / its.weights.sum(axis=1))
                         for its, one in zip(rights, found, strict=True)])
    recorded = _recorded(comparison.recordings.conditions, conditions)
    told = []
    for place in _best(distance.min(axis=0), conditions, recorded):
        rival = distance[:, place].argmin()
        one, run = found[rival], [place]
        told.append({"current_profile": int(conditions.current_profile[place]),
                     **{name: float(getattr(conditions, name)[place]) for name in _FACTORS},
                     "recorded": bool(recorded[place]), "apart": float(distance[rival, place]),
                     "signal": list(comparison.channels)[one.squares[:-1, place].argmax()],
                     "repetitions": repetitions(comparison, first, others[rival], conditions.take(run),
                                                    one.modes[run], seed)})
    return told


def tried(recorded: Conditions, seed: int) -> Conditions:
    """Combinations of recorded levels and a step beyond, each the next to be run; of very many, some at random."""
    levels = []
    for name in _FACTORS:
        known = np.unique(getattr(recorded, name))
        inside = np.quantile(known, np.linspace(0, 1, _LEVELS), method="nearest")
        levels.append(np.unique([*inside, _BEYOND[0] * known[0], _BEYOND[1] * known[-1]]))
    grid = np.array(list(product(np.unique(recorded.current_profile), *levels)))
    if len(grid) > _ENGAGEMENTS:
        grid = np.random.default_rng(seed).permutation(grid)[:_ENGAGEMENTS]
    order = None if recorded.run_order is None else np.full(len(grid), recorded.run_order.max() + 1)
    return replace(recorded, current_profile=grid[:, 0].astype(np.int64), run_order=order,
                   **dict(zip(_FACTORS, grid[:, 1:].T, strict=True)))


def _best(distance: np.ndarray, conditions: Conditions, recorded: np.ndarray) -> list[int]:
    """Places of the best, each of another current profile or motor speed, and of the best that was recorded."""
    chosen: list[int] = []
    kinds: set[tuple[int, float]] = set()
    for place in np.argsort(-distance, kind="stable"):
        kind = conditions.current_profile[place], conditions.motor_speed[place]
        new = kind not in kinds and len(chosen) < _BEST
        if new or (recorded[place] and not recorded[chosen].any()):
            chosen.append(int(place))
            kinds.add(kind)
    return chosen


def _recorded(recorded: Conditions, conditions: Conditions) -> np.ndarray:
    """Which of the conditions were recorded, (n,)."""
    same = conditions.current_profile[:, None] == recorded.current_profile
    for name in _FACTORS:
        same &= np.isclose(getattr(conditions, name)[:, None], getattr(recorded, name))
    return np.asarray(same.any(axis=1))
