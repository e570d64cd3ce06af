"""Draws a list of cases that has so many nulls, single effects and pairs of effects on each bench.

The cases of an effect are on different benches; those of a kind are alone about equally often, if possible each once.
Strengths of single effects are evenly spaced in the logarithm of their multiple of the limits of limits.py, and those
of two effects are drawn evenly in it.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from .effect import Effect
from .limits import complete
from .nominal import SETUPS
from .pairs import listed, pair
from .plan import Row, capped

COUNTS = (27,) * 10 + (54,) * 67 + (0,) * 19  # of the runs of 96 cases
Slot = tuple[Effect, str]  # an effect and the bench of its case


@dataclass(frozen=True)
class Quota:
    """What the list has on each bench.

    `benches` are those on which a case may have each of the `effects`. `tempted` are the temptations of nulls, `plain`
    is the number of other nulls, and `alone` those of single effects of listed pairs, of others, and over a further
    channel. `pairs` tells for each case with two effects whether both are in the same block; with `two_listed`, both
    are of listed pairs. Strengths are from `least` times the limit, for each kind of `alone`, or from `least_of_two`,
    to `most` times it. `counts` are the numbers of runs of the cases, in any order; 0 are all of the bench.
    """

    effects: tuple[Effect, ...]
    benches: Mapping[str, tuple[str, ...]]
    tempted: Mapping[str, tuple[str, ...]]
    plain: Mapping[str, int]
    alone: Mapping[str, tuple[int, int, int]]
    pairs: Mapping[str, tuple[bool, ...]]
    least: tuple[float, float, float] = (1.5, 2.0, 5.0)
    least_of_two: float = 3.0
    most: float = 40.0
    counts: tuple[int, ...] = COUNTS
    two_listed: bool = False


def twelve_each(effects: tuple[Effect, ...], benches: Mapping[str, tuple[str, ...]],
                tempting: Mapping[str, str], least_of_two: float = 4.0, two_listed: bool = False) -> Quota:
    """Return twelve cases on each drawn bench, of which one null has the temptation `tempting` of the bench.

    Two effects have strengths from `least_of_two` times the limit; if `two_listed`, both are of listed pairs.
    """
    return Quota(
        effects, benches,
        tempted={bench: (name,) for bench, name in tempting.items()},
        plain=dict.fromkeys(tempting, 1),
        alone={bench: (7, 1, int(i % 3 == 0)) for i, bench in enumerate(tempting)},
        pairs={bench: (i % 2 == 0,) if i % 3 == 0 else (True, False) for i, bench in enumerate(tempting)},
        least=(3.0, 4.0, 5.0), least_of_two=least_of_two, most=60.0, counts=(27,) * 14 + (54,) * 100 + (0,) * 30,
        two_listed=two_listed,
    )


def cases(quota: Quota, random: np.random.Generator) -> Iterator[Row]:
    """Yield the nulls, single effects, and pairs of those effects that are not alone on a bench."""
    drawn: list[tuple[str, str, dict[str, float]]] = []
    for bench, temptations in quota.tempted.items():
        drawn += [(bench, "any", {})] * quota.plain[bench]
        drawn += [(bench, f"any+{name}", {}) for name in temptations]
    together = None
    while together is None:  # a draw of the single effects may leave too few of a block
        alone = _singles(quota, random)
        together = _pairs(quota, {slot for slots in alone for slot in slots}, random)
    both_slots = [(effect, bench) for bench, both in together for effect in both]
    limits = complete((effect.name, bench) for slots in (*alone, both_slots) for effect, bench in slots)
    for slots, least in zip(alone, quota.least, strict=True):
        multiples = random.permutation(np.geomspace(least, quota.most, len(slots)))
        for (effect, bench), multiple in zip(slots, multiples, strict=True):
            drawn.append((bench, "any", {effect.name: capped(effect, multiple * limits[effect.name, bench])}))
    for bench, both in together:
        multiples = np.exp(random.uniform(np.log(quota.least_of_two), np.log(quota.most), 2))
        drawn.append((bench, "any", {effect.name: capped(effect, multiple * limits[effect.name, bench])
                                     for effect, multiple in zip(both, multiples, strict=True)}))
    for (bench, world, strengths), count in zip(drawn, random.permutation(quota.counts), strict=True):
        most = len(SETUPS[bench].profile)
        yield bench, world, min(int(count) or most, most), strengths


def _kind(effect: Effect) -> int:
    """Return the place of the kind of an effect in `Quota.alone`."""
    return 0 if listed(effect) else 2 if effect.abscissa == "oil_temperature" else 1


def _singles(quota: Quota, random: np.random.Generator) -> tuple[list[Slot], ...]:
    """Draw which effects are alone on which bench, for each kind; those least often alone on earlier ones are first."""
    slots: tuple[list[Slot], ...] = ([], [], [])
    for bench, counts in quota.alone.items():
        for number, count in enumerate(counts):
            already = Counter(effect.name for effect, _ in slots[number])
            could = [effect for effect in quota.effects
                     if _kind(effect) == number and bench in quota.benches[effect.name]]
            could = [could[i] for i in random.permutation(len(could))]
            could.sort(key=lambda effect: already[effect.name])
            slots[number].extend((effect, bench) for effect in could[:count])
    return slots


def _pairs(quota: Quota, taken: set[Slot],
           random: np.random.Generator) -> list[tuple[str, tuple[Effect, Effect]]] | None:
    """Draw the pairs of effects of each bench from those that are not alone on it, or return None if none are left."""
    drawn = []
    for bench, blocks in quota.pairs.items():
        left = [effect for effect in quota.effects
                if bench in quota.benches[effect.name] and (effect, bench) not in taken
                and (listed(effect) if quota.two_listed else _kind(effect) < 2)]
        for same_block in blocks:
            possible = [both for both in combinations(left, 2) if pair(both[0]) != pair(both[1])
                        and both[0].quantity != both[1].quantity and (both[0].block == both[1].block) == same_block]
            if not possible:
                return None
            drawn.append((bench, possible[random.integers(len(possible))]))
            left = [effect for effect in left if effect not in drawn[-1][1]]
    return drawn
