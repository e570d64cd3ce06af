"""Draws the list `FRESH` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_fresh

Half of the cases are on the bench `giant`. An effect has at most two cases, one of them on `giant` and one on the other
bench of `BENCHES` (fifth.py); each effect of a listed pair is alone in at least one. Strengths of single effects are
evenly spaced in the logarithm of their multiple of the limits of limits.py: 1.5 to 40 for listed pairs, 2 to 40 for
others, 5 to 40 over a further channel. Those of two effects are 3 to 40 times the limits.
"""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from .effect import Effect
from .fifth import BENCHES, FIFTH
from .limits import read as read_limits
from .nominal import SETUPS
from .pairs import listed, pair
from .plan import Row, capped, write

TEMPTED = {"giant": ("batches", "ambient", "loud_sensor", "many_bad_runs", "thermometer"),
           "heavy": ("batches", "loud_sensor", "thermometer"), "compact": ("ambient", "many_bad_runs")}
PLAIN = {"giant": 5, "heavy": 2, "compact": 3}  # nulls without a temptation
ALONE = {  # number of single effects of listed pairs, of others, and over a further channel
    "giant": (25, 5, 2), "heavy": (13, 2, 1), "compact": (12, 3, 1),
}
PAIRS = {"giant": (True, False) * 3, "heavy": (True, False, True), "compact": (False, True, False)}  # same block?
LEAST = (1.5, 2.0, 5.0)  # multiples of the limit, for the kinds of `ALONE`
MOST = 40.0
COUNTS = (27,) * 10 + (54,) * 67 + (0,) * 19  # of the runs, in a drawn order; 0 are all of the bench
Slot = tuple[Effect, str]  # an effect and the bench of its case


def fresh(random: np.random.Generator) -> Iterator[Row]:
    """Yield the nulls, single effects, and pairs of those effects that are not alone on a bench."""
    drawn: list[tuple[str, str, dict[str, float]]] = []
    for bench, temptations in TEMPTED.items():
        drawn += [(bench, "any", {})] * PLAIN[bench]
        drawn += [(bench, f"any+{name}", {}) for name in temptations]
    limits, together = read_limits(), None
    while together is None:  # a draw of the single effects may leave too few of a block
        alone = singles(random)
        together = pairs({slot for slots in alone for slot in slots}, random)
    for slots, least in zip(alone, LEAST, strict=True):
        multiples = random.permutation(np.geomspace(least, MOST, len(slots)))
        for (effect, bench), multiple in zip(slots, multiples, strict=True):
            drawn.append((bench, "any", {effect.name: capped(effect, multiple * limits[effect.name, bench])}))
    for bench, both in together:
        multiples = np.exp(random.uniform(np.log(3), np.log(MOST), 2))
        drawn.append((bench, "any", {effect.name: capped(effect, multiple * limits[effect.name, bench])
                                     for effect, multiple in zip(both, multiples, strict=True)}))
    for (bench, world, strengths), count in zip(drawn, random.permutation(COUNTS), strict=True):
        yield bench, world, int(count) or len(SETUPS[bench].profile), strengths


def kind(effect: Effect) -> int:
    """Return the place of the kind of an effect in `ALONE`."""
    return 0 if listed(effect) else 2 if effect.abscissa == "oil_temperature" else 1


def singles(random: np.random.Generator) -> tuple[list[Slot], ...]:
    """Draw which effects are alone on which bench, for each kind; those not alone on `giant` come first elsewhere."""
    slots: tuple[list[Slot], ...] = ([], [], [])
    for bench, counts in ALONE.items():
        for number, count in enumerate(counts):
            already = {effect.name for effect, _ in slots[number]}
            could = [effect for effect in FIFTH if kind(effect) == number and bench in BENCHES[effect.name]]
            could = [could[i] for i in random.permutation(len(could))]
            could.sort(key=lambda effect: effect.name in already)
            slots[number].extend((effect, bench) for effect in could[:count])
    return slots


def pairs(taken: set[Slot], random: np.random.Generator) -> list[tuple[str, tuple[Effect, Effect]]] | None:
    """Draw the pairs of effects of each bench from those that are not alone on it, or return None if none are left."""
    drawn = []
    for bench, blocks in PAIRS.items():
        left = [effect for effect in FIFTH
                if bench in BENCHES[effect.name] and (effect, bench) not in taken and kind(effect) < 2]
        for same_block in blocks:
            possible = [both for both in combinations(left, 2) if pair(both[0]) != pair(both[1])
                        and both[0].quantity != both[1].quantity and (both[0].block == both[1].block) == same_block]
            if not possible:
                return None
            drawn.append((bench, possible[random.integers(len(possible))]))
            left = [effect for effect in left if effect not in drawn[-1][1]]
    return drawn


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([23, 17])
    write("fresh", fresh(random), random, 8000, letter="g")


if __name__ == "__main__":
    main()
