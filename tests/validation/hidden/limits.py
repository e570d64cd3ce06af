"""Rough limits of the strengths of effects, from which they are visible; computed once and stored.

    python -m tests.validation.hidden.limits
"""

import csv
from collections.abc import Iterable, Iterator
from itertools import product
from pathlib import Path

import numpy as np

from .case import EFFECTS, LAWS
from .cases import LISTS
from .forms import BENCHES, ON_DRAWN
from .run import SIGNALS
from .signature import remaining

PATH = Path(__file__).parent / "data" / "limits.csv"
RUNS = 54
INDEPENDENT = 30  # samples of a signal per run, because deviations of a bench are smooth in time
STANDARD_DEVIATIONS = 6.0


def read() -> dict[tuple[str, str], float]:
    """Return the limits by effect and bench, in the unit of the strength."""
    with PATH.open() as file:
        return {(row["effect"], row["bench"]): float(row["limit"]) for row in csv.DictReader(file)}


def used() -> Iterator[tuple[str, str]]:
    """Yield each effect with each bench on which a list may have it, or has it where benches were drawn."""
    yield from product(EFFECTS, ("heavy", "compact"))
    for which, benches in BENCHES.items():
        if which in ON_DRAWN:
            yield from ((name, case.bench) for case in LISTS[which].values() for name in case.effects)
        else:
            yield from ((name, bench) for name in benches for bench in benches[name])


def compute(name: str, bench: str) -> float:
    """Return the strength at which the residual after a refit is `STANDARD_DEVIATIONS`, if it is proportional to it.

    The residual is that of `RUNS` runs with a noise of 1 %, in which seven parameters and the scatter of two parameters
    are fitted (signature.py).
    """
    typical = LAWS[name].typical
    residual = remaining({name: typical}, count=18, rounds=4, bench=bench)
    squares = {part: value**2 for part, value in residual.items()}
    per_run = INDEPENDENT * sum(squares[signal] for signal in SIGNALS) + squares["shifting_time"] + squares["scatter"]
    return typical * STANDARD_DEVIATIONS / float(np.sqrt(RUNS * per_run))


def complete(wanted: Iterable[tuple[str, str]]) -> dict[tuple[str, str], float]:
    """Compute and store the limits of those effects and benches that have none yet, and return all."""
    known = read()
    with PATH.open("a", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        for name, bench in wanted:
            if (name, bench) not in known:
                writer.writerow((name, bench, f"{compute(name, bench):.3g}"))
                file.flush()
    return read()


if __name__ == "__main__":
    complete(used())
