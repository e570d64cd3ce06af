"""The times of this project and of its peers for the same work, measured in alternating rounds of one run."""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

HEADER = ["work", "code", "median [ms]", "least", "most", "speedup of this project", "least", "most", "error", "unit",
          "target", "met"]
FASTEST = "the fastest peer"
OURS = "this project"


@dataclass(frozen=True)
class Code:
    """A function, and its error against the tight reference, or None.

    The times of a code that does a part of the work are multiplied by `scale`. It is run once before the first round,
    or `warm_up` instead, so that nothing is compiled in the rounds.
    """

    run: Callable[[], object]
    error: Callable[[], float] | None = None
    scale: float = 1.0
    warm_up: Callable[[], object] | None = None


@dataclass(frozen=True)
class Work:
    """Work of this project and of its peers by name.

    `targets` are the speedups aimed at, by peer or over `FASTEST`; `limit` is the largest median time in ms that is
    aimed at. `floors` are the parts of the work that no code can leave out, as fast as this machine does them.
    `left_out` has the peers that cannot run here, and why. `rounds` overrides the number of rounds, and `clock` returns
    the time in s.
    """

    name: str
    ours: Code
    peers: dict[str, Code]
    unit: str
    targets: dict[str, float]
    limit: float | None = None
    repeats: int = 3
    floors: dict[str, Code] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    rounds: int | None = None
    clock: Callable[[], float] = time.perf_counter


def measure(work: Work, rounds: int) -> list[list[object]]:
    """Measure a piece of work: the rows of the table, where a speedup is the ratio of two times of the same round."""
    codes = {OURS: work.ours, **work.peers, **work.floors}
    for code in codes.values():
        (code.warm_up or code.run)()
    times: dict[str, list[float]] = {name: [] for name in codes}
    rounds = work.rounds or rounds
    for number in range(rounds):
        for name, code in codes.items():
            best = min(_milliseconds(code, work.clock) for _ in range(work.repeats))
            times[name].append(code.scale * best)
        print(f"{work.name}: round {number + 1} of {rounds}", file=sys.stderr)
    errors = {name: code.error() if code.error else "" for name, code in codes.items()}
    spans = {name: np.array(values) for name, values in times.items()}
    limit = ["", ""] if work.limit is None else [f"{work.limit:g} ms", _verdict(np.median(spans[OURS]) <= work.limit)]
    rows: list[list[object]] = [[work.name, OURS, *spread(spans[OURS]), "", "", "", errors[OURS], work.unit, *limit]]
    fastest = min(work.peers, key=lambda name: float(np.median(spans[name])))
    for name in work.peers:
        ratios = spans[name] / spans[OURS]
        target = work.targets.get(name, work.targets.get(FASTEST) if name == fastest else None)
        verdict = ["", ""] if target is None else [f"{target:g}", _verdict(np.median(ratios) >= target)]
        rows.append([work.name, name, *spread(spans[name]), *spread(ratios), errors[name], work.unit, *verdict])
    rows.extend([work.name, f"floor: {name}", *spread(spans[name]), *spread(spans[name] / spans[OURS]), *[""] * 4]
                for name in work.floors)
    rows.extend([work.name, name, f"left out: {why}", *[""] * (len(HEADER) - 3)] for name, why in work.left_out.items())
    return rows


def spread(values: np.ndarray) -> tuple[float, float, float]:
    """Median, least and most."""
    return float(np.median(values)), float(np.min(values)), float(np.max(values))


def _milliseconds(code: Code, clock: Callable[[], float]) -> float:
    start = clock()
    code.run()
    return 1e3 * (clock() - start)


def _verdict(met: bool | np.bool_) -> str:
    return "yes" if met else "no"
