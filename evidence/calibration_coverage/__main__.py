"""Run the jobs of one kind, or of all kinds, that are not done yet, and replace their rows of the table."""

import argparse
import os
from collections.abc import Sequence
from functools import partial
from multiprocessing import get_context
from types import ModuleType

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported

from benchmarks.results import describe_machine
from evidence import calibration_coverage
from evidence.calibration_coverage import calibrations, coefficients, fits
from evidence.calibration_coverage.table import replace_rows
from evidence.kept import Job, Result, open_processes, read_count, run_jobs
from evidence.runner import WORK, name_commit

KINDS: dict[str, ModuleType] = {"calibrations": calibrations, "fits": fits, "coefficients": coefficients}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the kind that the command names, or all."""
    parser = argparse.ArgumentParser(prog="python -m evidence.calibration_coverage",
                                     description=(calibration_coverage.__doc__ or "").split("\n")[0])
    parser.add_argument("kind", nargs="?", choices=KINDS, help="by default all of them")
    parser.add_argument("--sets", type=read_count, metavar="N", help="number of simulated sets (default: " + ", ".join(
        f"{module.SETS} of {kind}" for kind, module in KINDS.items()) + ")")
    chosen, version = parser.parse_args(arguments), name_commit()
    for kind in [chosen.kind] if chosen.kind else KINDS:
        module = KINDS[kind]
        sets = chosen.sets or module.SETS
        jobs, results = module.list_jobs(sets), dict[Job, Result]()
        for job, result in run_jobs(module.run_job, jobs, WORK / f"coverage-{kind}-{version}.jsonl",
                                    partial(open_processes, get_context("spawn"))):
            results[job] = result
            print(f"{len(results)}/{len(jobs)} {job}", flush=True)
        replace_rows(kind, module.make_rows([results[job] for job in jobs]),
                     f"`python -m evidence.calibration_coverage {kind} --sets {sets}`: {describe_machine()}")


if __name__ == "__main__":
    main()
