"""Draws two of the lists of cases.py (the others: plan_unseen.py, plan_elsewhere.py, plan_fresh.py, plan_later.py,
plan_further.py, plan_beyond.py, plan_drawn.py).

Run once for each list, because a list is fixed before anything is run on it.

    python -m tests.validation.hidden.plan development|final
"""

import csv
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from .case import Case, simulate
from .catalogue import PHYSICAL, UNLISTED
from .effect import Effect
from .limits import read as read_limits
from .pairs import listed
from .sensors import SENSORS
from .unseen import UNSEEN
from .world import INGREDIENTS

Row = tuple[str, str, int, dict[str, float]]  # bench, world, count, and strengths of effects
BENCHES = ("heavy", "compact")
MANY = {"heavy": 108, "compact": 90}
LOCKED = 0.9  # least fraction of runs that lock
LARGEST_RATIO = 5.0  # of a quantity with its effect to that without it
LARGEST_STRENGTH = 8.0  # of cases of the final list, relative to the typical strength


def development(random: np.random.Generator) -> Iterator[Row]:
    """Yield 15 nulls, each known effect alone, and 23 pairs of effects."""
    for i, ingredients in enumerate(("none", "none", *INGREDIENTS, "any", "any", "any", "any")):
        yield BENCHES[i % 2], ingredients, 54, {}
    for bench in BENCHES:
        yield bench, "any", MANY[bench], {}
    effects = [*PHYSICAL, *SENSORS, *UNLISTED]
    for i, effect in enumerate(effects):
        multiple = float(np.exp(random.uniform(np.log(0.5), np.log(10))))
        bench = BENCHES[i % 2]
        strengths = {effect.name: multiple * effect.typical}
        yield bench, ("none", "any")[i // 2 % 2], MANY[bench] if i % 10 == 4 else 54, strengths
    for i in range(23):
        pair = two(effects, same_block=i % 2 == 0, random=random)
        multiples = np.exp(random.uniform(np.log(0.7), np.log(7), 2))
        bench = BENCHES[i // 2 % 2]
        strengths = [float(multiple) * effect.typical for effect, multiple in zip(pair, multiples, strict=True)]
        names = [effect.name for effect in pair]
        yield bench, ("any", "none")[i // 4 % 2], 54, dict(zip(names, strengths, strict=True))


def final(random: np.random.Generator) -> Iterator[Row]:
    """Yield 32 nulls, each unseen effect alone, some of them on both benches, and 22 pairs of effects.

    The strengths are 0.5 to 30 times the limits of limits.py, evenly in the logarithm.
    """
    limits = read_limits()
    for bench in BENCHES:
        for ingredients in ("none", *INGREDIENTS, *["any"] * 7):
            yield bench, ingredients, 54, {}
        yield bench, "any", MANY[bench], {}
    listed_first = sorted(UNSEEN, key=lambda effect: not listed(effect))
    chosen = [(effect, BENCHES[i % 2]) for i, effect in enumerate(listed_first)]
    again = [(effect, BENCHES[1 - i % 2]) for i, effect in enumerate(listed_first)]
    chosen += [pair for i, pair in enumerate(again) if (i % 4 < 2 if listed(pair[0]) else i % 6 == 0)]
    for i, multiple in enumerate(random.permutation(np.geomspace(0.5, 30, len(chosen)))):
        effect, bench = chosen[i]
        strength = multiple * limits[effect.name, bench]
        yield bench, "any", MANY[bench] if i % 9 == 4 else 54, {effect.name: capped(effect, strength)}
    for i in range(22):
        bench = BENCHES[i // 2 % 2]
        pair = two(list(UNSEEN), same_block=i % 2 == 0, random=random)
        multiples = np.exp(random.uniform(np.log(1), np.log(30), 2))
        yield bench, "any", 54, {effect.name: capped(effect, multiple * limits[effect.name, bench])
                                 for effect, multiple in zip(pair, multiples, strict=True)}


def capped(effect: Effect, strength: float) -> float:
    """Return the strength, at most `LARGEST_STRENGTH` times typical."""
    return float(min(strength, LARGEST_STRENGTH * effect.typical))


def two(effects: list[Effect], same_block: bool, random: np.random.Generator) -> tuple[Effect, Effect]:
    """Draw two of the effects, of different quantities."""
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
    return len(run.conditions) >= LOCKED * min(27, len(case.setup.profile))


def write(name: str, drawn: Iterator[Row], random: np.random.Generator, first_seed: int,
          letter: str = "", folder: Path = Path(__file__).parent / "data") -> None:
    """Write the list `name` to a folder, in random order, with seeds from `first_seed` + 1 on.

    The ids begin with `letter`, by default the first of the name.
    """
    rows, drawn_rows = [], list(drawn)
    for i, place in enumerate(random.permutation(len(drawn_rows)), start=1):
        bench, world, count, strengths = drawn_rows[place]
        seed = first_seed + i
        strengths = plausible(bench, seed, strengths)
        effects = "+".join(f"{effect}:{strength:.3g}" for effect, strength in strengths.items())
        rows.append((f"{letter or name[0]}{i:03}", bench, world, count, seed, effects))
    with (folder / f"{name}.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("id", "bench", "world", "count", "seed", "effects"))
        writer.writerows(rows)


def main(name: str) -> None:
    """Draw the list `name` and write it."""
    random = np.random.default_rng([20, len(name)])
    write(name, {"development": development, "final": final}[name](random), random, 1000 * len(name))


if __name__ == "__main__":
    main(sys.argv[1])
