"""Answer cases of other machines by the engine and by its peers, judge all alike, and write the table."""

import argparse
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported

import numpy as np

from evidence import peers
from evidence.answer import Answer
from evidence.generator.truth import HiddenEffect, Truth
from evidence.judge import judge
from evidence.kept import read_count
from evidence.laws import compare
from evidence.peers.residuals import answer_by_residuals
from evidence.peers.sindy import answer_by_sindy
from evidence.rates import Entry
from evidence.real import emps
from evidence.runner import answer_case, answer_cases
from evidence.suites import OTHER_MACHINES
from evidence.tables import write_table

TABLE = Path(__file__).parents[1] / "peers.csv"
METHODS = "engine", "residuals", "sindy"
HEADER = ("method", "recordings", "cases with an effect", "right first", "in the answer", "with a name too many",
          "names in an answer", "cases without an effect", "something named", "law: cases", "law: relative rms error",
          "seconds", "times the engine", "errors")
_TIMED = 4


@dataclass(frozen=True)
class Summary:
    """What a method said of some cases: counts, and medians over cases."""

    effects: int
    right_first: int
    in_answer: int
    too_many: int
    names: float
    nulls: int
    alarms: int
    laws: int
    law_error: float
    seconds: float
    errors: int


def summarise(entries: Sequence[Entry]) -> Summary:
    """Return the summary of the answers of a method."""
    verdicts = [(entry, judge(entry.answer, entry.truth)) for entry in entries]
    hidden = [(entry, verdict) for entry, verdict in verdicts if entry.truth.hidden]
    nulls = [(entry, verdict) for entry, verdict in verdicts if not entry.truth.hidden]
    laws = [error for entry in entries for error in [measure_law(entry.answer, entry.truth)] if error is not None]
    return Summary(len(hidden), sum(verdict.right_first for _, verdict in hidden),
                   sum(verdict.effects_named > 0 for _, verdict in hidden),
                   sum(verdict.effects_named > 0 and verdict.too_many > 0 for _, verdict in hidden),
                   float(np.mean([len(entry.answer.findings) for entry, _ in hidden])) if hidden else 0.0,
                   len(nulls), sum(not verdict.silent for _, verdict in nulls), len(laws),
                   float(np.median(laws)) if laws else float("nan"),
                   float(np.median([entry.answer.seconds for entry in entries])),
                   sum(bool(entry.answer.error) for entry in entries))


def measure_law(answer: Answer, truth: Truth) -> float | None:
    """Return the RMS difference of a law to the hidden one over the visited range, over the RMS of that.

    None where the hidden pair itself is not in the answer, or is not one over a number.
    """
    laws = {law.pair: law for law in answer.laws}
    for hidden in truth.hidden:
        if hidden.pair in laws and hidden.grid and _is_over_number(hidden):
            difference = compare(laws[hidden.pair], hidden, truth)
            return None if difference is None else difference.share
    return None


def _is_over_number(hidden: HiddenEffect) -> bool:
    over = {"sequence": "run order"}.get(hidden.abscissa, hidden.abscissa)
    return hidden.pair[1] == over or (hidden.pair[1] == "gain" and hidden.quantity == f"{over} sensor")


def time_methods(seeds: Sequence[int]) -> dict[str, float]:
    """Return the median ratio of the time of each method to that of the engine; cases are answered in turn."""
    times = np.array([[answer_case(method, OTHER_MACHINES, seed).answer.seconds for method in METHODS]
                      for seed in seeds])
    return dict(zip(METHODS, np.median(times / times[:, :1], axis=0).tolist(), strict=True))


def answer_emps(folder: Path) -> list[tuple[str, ...]]:
    """Return the rows of the peers' answers to recordings of a positioning system, which lacks Coulomb friction."""
    recorded, rows = emps.read(folder), list[tuple[str, ...]]()
    for name, method in (("residuals", answer_by_residuals), ("sindy", answer_by_sindy)):
        try:
            answer = method("emps", recorded)
        except Exception as error:  # is a result: a wrong one
            answer = Answer("emps", error=repr(error))
        pairs = [each.pair for each in answer.findings]
        right = ("friction force", "velocity")
        rows.append((name, "emps", "1", str(int(pairs[:1] == [right])), str(int(right in pairs)),
                     str(int(right in pairs and len(pairs) > 1)), str(len(pairs)), "0", "0", "0", "", "", "",
                     str(int(bool(answer.error)))))
        print(name, "emps", answer.error or " + ".join(" over ".join(pair) for pair in pairs), sep=": ")
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Answer the cases that are not kept yet, and write the table."""
    parser = argparse.ArgumentParser(prog="python -m evidence.peers", description=(peers.__doc__ or "").split("\n")[0])
    parser.add_argument("--seed", type=read_count, default=1, help="seed of the first case (default: 1)")
    parser.add_argument("--cases", type=read_count, default=24, help="number of cases (default: 24)")
    parser.add_argument("--emps", type=Path, metavar="FOLDER", help="recordings of evidence.real, answered as well")
    parser.add_argument("--out", type=Path, default=TABLE, help=f"table that is written (default: {TABLE.name})")
    chosen = parser.parse_args(arguments)
    seeds = range(chosen.seed, chosen.seed + chosen.cases)
    cases = [(OTHER_MACHINES, seed) for seed in seeds]
    entries = {method: list(answer_cases(method, cases)) for method in METHODS}
    ratios = time_methods(seeds[-_TIMED:])
    rows = [_row(method, words, summarise([entry for entry in entries[method] if part in entry.truth.case]),
                 f"{ratios[method]:.2f}" if words == "both" else "")
            for words, part in (("both", "/"), ("tanks", "/two-tanks/"), ("motor", "/dc-motor/")) for method in METHODS]
    write_table(chosen.out, HEADER, [*rows, *(answer_emps(chosen.emps) if chosen.emps else ())])
    print(chosen.out.read_text())


def _row(method: str, recordings: str, each: Summary, ratio: str) -> tuple[object, ...]:
    return (method, recordings, each.effects, each.right_first, each.in_answer, each.too_many, f"{each.names:.2g}",
            each.nulls, each.alarms, each.laws, f"{each.law_error:.2f}", f"{each.seconds:.0f}", ratio,
            each.errors)


if __name__ == "__main__":
    main()
