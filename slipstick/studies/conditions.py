"""The conditions of engagements as the blocks have measured them, beside those that were stated.

A motor that is set to 105 rad/s may run at 108. Torque and speeds show it in each engagement, whatever is missing in
the model upstream, so that it need not count as an error of a prediction.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.confirmation.simulated import CONDITIONS, RANDOM
from slipstick.numerics.levels import has_levels
from slipstick.studies.result import MeasuredCondition

_BELIEVED = 3.0
"""Standard deviations of levels and scatter beyond which a block has not measured a condition: a sensor that froze is
explained by four times the inertia."""


def with_measured(stated: Conditions, changes: Mapping[str, np.ndarray]) -> Conditions:
    """The `stated` conditions of n engagements, with the `changes` (n,) that were found, relative to each of them.

    Those of an engagement that no bench could have are as stated.
    """
    def drop_implausible(name: str) -> np.ndarray:
        own, widest = RANDOM[name]
        return np.where(np.abs(changes[name]) <= _BELIEVED * np.hypot(own, widest), changes[name], 0.0)

    return replace(stated, **{name: getattr(stated, name) * (1 + drop_implausible(name))
                              for name in CONDITIONS if name in changes})


def by_level(stated: Conditions, measured: Conditions) -> Iterator[MeasuredCondition]:
    """Each stated level of a condition that was measured, and how far the engagements of this level are from it."""
    for name in CONDITIONS:
        levels, values = getattr(stated, name), getattr(measured, name)
        if values is not levels and has_levels(levels):
            for level in np.unique(levels[levels != 0]):
                off = values[levels == level] / level - 1
                yield MeasuredCondition(name, float(level), float(off.mean()), float(off.std()), len(off))
