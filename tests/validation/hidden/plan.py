"""Draws the lists of cases.py; run once for each list, because a list is fixed before anything is run on it.

    python -m tests.validation.hidden.plan development
"""

import csv
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from .case import LAWS, Case, simulate
from .catalogue import PHYSICAL, UNLISTED
from .effect import Effect
from .sensors import SENSORS
from .world import INGREDIENTS

Row = dict[str, str]
BENCHES = ("heavy", "compact")
MANY = {"heavy": 108, "compact": 90}
LOCKED = 0.9  # least fraction of runs that lock
LARGEST_RATIO = 5.0  # of a quantity with its effect to that without it


def development(random: np.random.Generator) -> Iterator[tuple[str, str, int, dict[str, float]]]:
    """Yield bench, world, count and effects: 15 nulls, each known effect alone, and 23 pairs of effects."""
    for i, ingredients in enumerate(("none", "none", *INGREDIENTS, "any", "any", "any", "any")):
        yield BENCHES[i % 2], ingredients, 54, {}
    for bench in BENCHES:
        yield bench, "any", MANY[bench], {}
    effects = [*PHYSICAL, *SENSORS, *UNLISTED]
    for i, effect in enumerate(effects):
        multiple = float(np.exp(random.uniform(np.log(0.5), np.log(10))))
        bench = BENCHES[i % 2]
        yield bench, ("none", "any")[i // 2 % 2], MANY[bench] if i % 10 == 4 else 54, {effect.name: multiple}
    for i in range(23):
        names = [effect.name for effect in _pair(effects, same_block=i % 2 == 0, random=random)]
        multiples = np.exp(random.uniform(np.log(0.7), np.log(7), 2))
        bench = BENCHES[i // 2 % 2]
        yield bench, ("any", "none")[i // 4 % 2], 54, dict(zip(names, multiples.tolist(), strict=True))


def _pair(effects: list[Effect], same_block: bool, random: np.random.Generator) -> tuple[Effect, Effect]:
    while True:
        first, second = (effects[i] for i in random.permutation(len(effects))[:2])
        if (first.block == second.block) == same_block and first.quantity != second.quantity:
            return first, second


def plausible(bench: str, seed: int, strengths: Mapping[str, float]) -> dict[str, float]:
    """Return the strengths, reduced until nearly all runs lock and no quantity changes by more than a large ratio."""
    strengths = dict(strengths)
    while not _is_plausible(Case(strengths, seed, count=27, bench=bench)):
        strengths = {name: strength / 1.5 for name, strength in strengths.items()}
    return strengths


def _is_plausible(case: Case) -> bool:
    try:
        run = simulate(case, relative=1e-5)
    except RuntimeError:
        return False
    for effect, strength in run.bench.effects:
        if effect.kind == "ratio":
            change = run.bench.change(effect, strength, run.quantities[effect.abscissa])
            if not 1 / LARGEST_RATIO < np.min(change) <= np.max(change) < LARGEST_RATIO:
                return False
    return len(run.conditions) >= LOCKED * 27


def main(name: str) -> None:
    """Draw the list `name` and write it."""
    random = np.random.default_rng([20, len(name)])
    drawn = list({"development": development}[name](random))
    rows = []
    for i, place in enumerate(random.permutation(len(drawn)), start=1):
        bench, world, count, multiples = drawn[place]
        seed = 1000 * len(name) + i
        strengths = {effect: multiple * LAWS[effect].typical for effect, multiple in multiples.items()}
        strengths = plausible(bench, seed, strengths)
        effects = "+".join(f"{effect}:{strength:.3g}" for effect, strength in strengths.items())
        rows.append((f"{name[0]}{i:03}", bench, world, count, seed, effects))
    with (Path(__file__).parent / "data" / f"{name}.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("id", "bench", "world", "count", "seed", "effects"))
        writer.writerows(rows)


if __name__ == "__main__":
    main(sys.argv[1])
