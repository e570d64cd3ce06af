"""The words of an answer: what a finding is called, from the catalogue of effects."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from slipstick.clutch.effects import find, matching
from slipstick.clutch.effects.effect import DEPENDENCES, QUANTITIES, SENSORS
from slipstick.naming.block import Pair
from slipstick.naming.measured import LawPoints
from slipstick.naming.selection import Finding, Rival
from slipstick.naming.varying_lag import with_constant_lag

MOST_TIED = 3
"""Names in a tie at most: more tell nobody anything, and the answer is then the pair."""
_ANY_LINE = 10.0
"""Standard deviation of a straight line that a law is known up to, over its largest change: such a law has no slope."""


@dataclass(frozen=True)
class Answer:
    """What a finding is called: an `effect` of the catalogue, a tie of it with `others`, or no effect (unlisted)."""

    kind: Literal["effect", "tie", "unlisted"]
    pair: Pair
    effect: str
    others: tuple[str, ...]


def names(pair: Pair, catalogue: Collection[str] | None = None) -> tuple[str, ...]:
    """The effects that change this quantity in dependence on this: those of the `catalogue` where it is given."""
    quantity, depends_on = pair
    if quantity not in {**QUANTITIES, **SENSORS} or depends_on not in DEPENDENCES:
        return ()  # blocks are asked for more pairs than effects can have
    return tuple(effect.name for effect in matching(quantity, depends_on)
                 if catalogue is None or effect.name in catalogue)


def next_best(pair: Pair, others: Sequence[Rival]) -> Rival | None:
    """The one of `others` that gains most, of those that no effect of the catalogue changes together with a `pair`."""
    return max((rival for rival in others if is_another_effect(rival.pair, pair)), key=lambda rival: rival.nats,
               default=None)


def is_another_effect(pair: Pair, other: Pair) -> bool:
    """Whether no effect of the catalogue changes both pairs: a lag over something is one with any other lag."""
    return with_constant_lag(pair) != with_constant_lag(other) and set(names(pair)).isdisjoint(names(other))


def _has_shape(name: str, law: LawPoints) -> bool:
    effect = find(name)
    # The shape is that of the change of the effect's own quantity.
    if effect.shape is None or law.x is None or len(law.x) < 2 or law.pair != effect.pairs[0]:
        return True
    covariance = law.cautious_covariance
    if law.up_to == "line":
        line = (law.x - law.x.mean()) / np.ptp(law.x)
        covariance = covariance + (_ANY_LINE * max(np.abs(law.change).max(), law.std.max())) ** 2 * np.outer(line, line)
    return effect.shape.is_met(law.x, law.change, covariance)


def answer(finding: Finding, law: LawPoints | None = None, catalogue: Collection[str] | None = None) -> Answer:
    """The words for a finding. Pairs without a name count in a tie by the pair itself.

    Where its `law` is given, an effect must have its shape; where a `catalogue` is, it must be in it.
    """
    own = tuple(name for name in names(finding.pair, catalogue) if law is None or _has_shape(name, law))
    others = [*own[1:], *(name for rival in finding.rivals
                          for name in names(rival.pair, catalogue) or (" ~ ".join(rival.pair),))]
    others = [name for name in dict.fromkeys(others) if name not in own[:1]][:MOST_TIED - 1]
    if not own:
        return Answer("tie" if others else "unlisted", finding.pair, "", tuple(others))
    return Answer("tie" if others else "effect", finding.pair, own[0], tuple(others))
