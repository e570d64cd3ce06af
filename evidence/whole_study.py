"""Whole studies of drawn cases: what the simulation of the bench confirms, the gap, and how much a wrong effect closes.

    python -m evidence.whole_study [--seed N] [--cases K]

Of every four cases, two have one known effect, one has an unknown effect, and one has none. A finding is *confirmed* if
the simulation supports it. A gap is *closed* if the study says that at least 80 % of it are. The control is the best
effect on another quantity. The rates are those of studies whose findings are right and complete. Finished studies are
kept in var/evidence/whole_study-*.jsonl, of each version.
"""

import argparse
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from evidence.answer import Answer, NamedPair
from evidence.judge import judge
from evidence.kept import Job, Result, open_processes, read_count, run_jobs
from evidence.rates import Rate, count_hits
from evidence.runner import WORK, name_commit, write_case
from evidence.tables import print_rates, write_rates
from slipstick.bench import Bench
from slipstick.confirmation.gap import WITHIN
from slipstick.recordings import Recordings
from slipstick.studies import StudySettings, conclude, examine

TABLE = Path(__file__).with_name("whole_study.csv")
SUITES = ("one_known_effect", "one_unknown_effect", "one_known_effect", "nothing_missing")
CLOSED = 0.8
"""Least share of a gap that is closed."""


@dataclass(frozen=True)
class Closures:
    """The share that the findings close of each significant gap, of those within runs and of the others."""

    within: list[float]
    between: list[float]


@dataclass(frozen=True)
class WholeStudy:
    """What a study of a case concludes: `is_right` if its findings are those that are hidden and nothing else."""

    case: str
    is_null: bool
    is_right: bool
    converged: int = 0
    fits: int = 0
    confirmed: bool = False
    findings: Closures | None = None
    control: Closures | None = None
    error: str = ""


def study_case(suite: str, seed: int) -> WholeStudy:
    """Study a case."""
    files, settings = write_case(suite, seed), StudySettings()
    truth = files.truth
    bench, recordings = Bench.open(files.bench), Recordings.open(files.recordings)
    try:
        result, _ = conclude(settings, bench, recordings, examine(settings, bench, recordings))
    except Exception as error:  # a study that raises is a result: a wrong one
        return WholeStudy(truth.case, not truth.hidden, is_right=False, error=repr(error))
    answer = Answer(truth.case, tuple(NamedPair((each.quantity, each.depends_on)) for each in result.findings))
    verdict = judge(answer, truth)
    agrees = [each.confirmation.agrees for each in result.findings if each.confirmation.agrees is not None]
    gap = result.gap
    return WholeStudy(
        truth.case, not truth.hidden, verdict.effects_named == len(truth.hidden) and not verdict.too_many,
        result.before.converged + result.after.converged, 2, all(agrees),
        None if gap is None else _closures(gap.closures),
        None if gap is None or gap.control is None else _closures(gap.control.closures))


def study_as_json(suite: str, seed: int) -> Result:
    """Return the study of a case as JSON has it."""
    return asdict(study_case(suite, seed))


def read_study(result: Result) -> WholeStudy:
    """Return the study of `study_as_json`."""
    closures = {name: result[name] and Closures(**result[name]) for name in ("findings", "control")}
    return WholeStudy(**{**result, **closures})


def _closures(closures: dict) -> Closures:
    significant = {name: each.closure for name, each in closures.items() if each.closure is not None}
    return Closures([value for name, value in significant.items() if name == WITHIN],
                    [value for name, value in significant.items() if name != WITHIN])


def rate(studies: Sequence[WholeStudy]) -> list[Rate]:
    """Return the rates of all studies."""
    right = [each for each in studies if each.is_right and not each.is_null]
    count = partial(count_hits, "whole_study")
    rates = [count("studies that raised an error", "reported", [bool(each.error) for each in studies]),
             Rate("whole_study", "fits of the simulation that converged", "reported",
                  sum(each.converged for each in studies), sum(each.fits for each in studies)),
             count("nothing missing: a gap that is called closed", "reported",
                   [each.findings is not None for each in studies if each.is_null]),
             count("right findings that the simulation confirms", "reported", [each.confirmed for each in right])]
    for where in ("within", "between"):
        words = "within runs" if where == "within" else "of a signal or the shifting time, on held-out conditions"
        for whose, label in (("findings", "right findings"), ("control", "their controls, a wrong effect")):
            shares = [share for each in right if getattr(each, whose) for share in getattr(getattr(each, whose), where)]
            rates.append(count(f"{label}: significant gaps {words} closed by {100 * CLOSED:g} % or more", "reported",
                               [share >= CLOSED for share in shares]))
    return [each for each in rates if each.of]


def main() -> None:
    """Study the cases that are left, and write the table."""
    parser = argparse.ArgumentParser(prog="python -m evidence.whole_study", description=__doc__)
    parser.add_argument("--seed", type=read_count, default=301, help="seed of the first case (default: 301)")
    parser.add_argument("--cases", type=read_count, default=24, help="number of cases (default: 24)")
    arguments = parser.parse_args()
    wanted = [(SUITES[number % len(SUITES)], arguments.seed + number) for number in range(arguments.cases)]
    done, version = dict[Job, WholeStudy](), name_commit()
    for case, result in run_jobs(study_as_json, wanted, WORK / f"whole_study-{version}.jsonl", open_processes):
        done[case] = read_study(result)
        print(done[case], flush=True)
    rates = rate([done[case] for case in wanted])
    write_rates(TABLE, f"study {version}", rates)
    print(print_rates(rates))


if __name__ == "__main__":
    main()
