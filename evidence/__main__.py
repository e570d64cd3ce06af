"""How often a study is right: draws cases of some suites, has a method answer them, and prints the rates."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one core for each case; before numpy is imported

from evidence import regression
from evidence.kept import read_count
from evidence.methods import METHODS
from evidence.picture import draw_rates
from evidence.rates import Entry, compare_methods, rate
from evidence.real import command
from evidence.runner import WORK, answer_cases, read_answers, read_entries, write_case
from evidence.suites import OTHER_MACHINES, SUITES
from evidence.tables import print_comparison, print_rates, write_answers, write_rates
from slipstick.errors import SlipstickError
from slipstick.interruption import STATUS
from worker.executors import add_dask_argument

CASES = {"nothing_missing": 40, "one_known_effect": 80, "one_unknown_effect": 40, "two_effects": 24,
         "wrong_parameter": 16, "faulty_recordings": 16, "missing_signals": 16, "further_channel": 16,
         OTHER_MACHINES: 40}
"""How many cases of each suite are answered by default: together up to an hour of two cores."""
DEFAULT = "naming"
REAL = "real"


def main(arguments: Sequence[str] | None = None) -> int:
    """Answer the cases, and return the exit status: 1 where a regression is worse than before."""
    given = sys.argv[1:] if arguments is None else arguments
    if given and given[0] == REAL:
        return command.main(given[1:])
    parser = argparse.ArgumentParser(prog="python -m evidence", description=__doc__)
    parser.add_argument("suites", nargs="+", choices=[*SUITES, "all", OTHER_MACHINES, "regression"], metavar="SUITE",
                        help=f"{', '.join(SUITES)}, all of them, {OTHER_MACHINES}, or the regression suite; "
                             f"`{REAL} --help` tells of real recordings")
    parser.add_argument("--seed", type=read_count, default=1,
                        help="seed of the first case (default: 1); those behind it have the following seeds")
    parser.add_argument("--cases", type=read_count, help="number of cases of each suite (default: "
                                                  f"{', '.join(f'{suite} {count}' for suite, count in CASES.items())})")
    parser.add_argument("--method", metavar="NAME|FILE",
                        help=f"what answers: {', '.join(METHODS)}, or a file of answers that another program or "
                             "checkout gave (default: naming, and of other machines the engine); others are compared "
                             "with it, on the same cases")
    parser.add_argument("--files", type=Path, metavar="FOLDER",
                        help="only write the files of the cases, and their truth apart, to this folder")
    parser.add_argument("--out", type=Path, default=WORK, metavar="FOLDER",
                        help="folder of rates.csv, answers.csv and rates.svg (default: var/evidence)")
    add_dask_argument(parser)
    chosen = parser.parse_args(arguments)
    if "regression" in chosen.suites:
        return regression.check(chosen.dask)
    suites = [*SUITES] if "all" in chosen.suites else chosen.suites
    cases = [(suite, chosen.seed + number) for suite in suites for number in range(chosen.cases or CASES[suite])]
    if chosen.method is None:
        chosen.method = "engine" if suites == [OTHER_MACHINES] else DEFAULT
    if chosen.files:
        for case in cases:
            print(write_case(*case, chosen.files).truth.case)
        return 0
    if chosen.method not in METHODS and not Path(chosen.method).exists():
        parser.error(f"'{chosen.method}' is neither a method ({', '.join(METHODS)}) nor a file of answers")
    entries = list[Entry]()
    for entry in (answer_cases(chosen.method, cases, chosen.dask) if chosen.method in METHODS
                  else read_answers(Path(chosen.method), cases)):
        entries.append(entry)
        print(f"{len(entries)}/{len(cases)} {entry.truth.case}: {describe(entry)}", flush=True)
    _write(chosen.out, chosen.method, entries)
    if chosen.method != DEFAULT:
        kept = read_entries(DEFAULT)
        before = [kept[case] for case in cases if case in kept]
        print(f"\nBeside {DEFAULT}, on the cases that both have answered:")
        print(print_comparison(compare_methods(before, entries)))
    return 0


def describe(entry: Entry) -> str:
    """Return an answer in a line."""
    answer = entry.answer.reported
    said = " + ".join(f"{' over '.join(each.pair)} ({each.confidence:.2f})" for each in answer.findings)
    rest = "".join(f"; {words}: {', '.join(values)}" for words, values in (
        ("unexplained", answer.unexplained), ("possible", [" over ".join(pair) for pair in answer.explanations]))
        if values)
    return (answer.error or (said or "nothing named") + rest) + f" [{answer.seconds:.0f} s]"


def _write(folder: Path, method: str, entries: list[Entry]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    label, rates = " ".join([Path(method).name, *sorted({entry.version for entry in entries})]).strip(), rate(entries)
    write_rates(folder / "rates.csv", label, rates)
    write_answers(folder / "answers.csv", label, entries)
    if any(entry.suite == "one_known_effect" for entry in entries):
        (folder / "rates.svg").write_bytes(draw_rates(entries))
    print(f"\n{print_rates(rates)}\n\nWritten to {folder / 'rates.csv'} and {folder / 'answers.csv'}")


if __name__ == "__main__":
    try:
        sys.exit(main())
    except SlipstickError as error:
        sys.exit(f"{error}")
    except KeyboardInterrupt:
        print("\nInterrupted; the same command goes on with the cases that are left", file=sys.stderr)
        sys.exit(STATUS)
