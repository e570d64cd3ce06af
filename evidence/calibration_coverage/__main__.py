"""Run the jobs of one kind, or of all kinds, that are not done yet, and replace their rows of the table."""

import argparse
import json
import os
from collections.abc import Hashable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from types import ModuleType
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one core for each process; before numpy is imported
os.environ.setdefault("NUMBA_NUM_THREADS", "1")

from evidence import calibration_coverage
from evidence.calibration_coverage import calibrations, coefficients, fits
from evidence.calibration_coverage.table import replace_rows
from evidence.robustness.table import describe_machine
from evidence.runner import PROCESSES, WORK

KINDS: dict[str, ModuleType] = {"calibrations": calibrations, "fits": fits, "coefficients": coefficients}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the kind that the command names, or all."""
    parser = argparse.ArgumentParser(prog="python -m evidence.calibration_coverage",
                                     description=(calibration_coverage.__doc__ or "").split("\n")[0])
    parser.add_argument("kind", nargs="?", choices=KINDS, help="by default all of them")
    parser.add_argument("--sets", type=int, metavar="N", help="number of simulated sets (default: " + ", ".join(
        f"{module.SETS} of {kind}" for kind, module in KINDS.items()) + ")")
    chosen = parser.parse_args(arguments)
    for kind in [chosen.kind] if chosen.kind else KINDS:
        module = KINDS[kind]
        sets = chosen.sets or module.SETS
        results = dict(run_jobs(module, module.list_jobs(sets), WORK / f"coverage-{kind}.jsonl"))
        replace_rows(kind, module.make_rows([results[job] for job in module.list_jobs(sets)]),
                     f"`python -m evidence.calibration_coverage {kind} --sets {sets}`: {describe_machine()}")


def run_jobs(module: ModuleType, jobs: Sequence[tuple[Hashable, ...]],
             kept: Path) -> Iterator[tuple[tuple[Hashable, ...], dict[str, Any]]]:
    """Yield each job with its result as JSON has it: those in the file `kept`, then the others, which it gets."""
    kept.parent.mkdir(parents=True, exist_ok=True)
    lines = map(json.loads, kept.read_text().splitlines()) if kept.exists() else ()
    done = {tuple(line["job"]): line["result"] for line in lines}
    yield from ((job, done[job]) for job in jobs if job in done)
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool, kept.open("a") as file:
        futures = {pool.submit(module.run_job, *job): job for job in jobs if job not in done}
        for number, future in enumerate(as_completed(futures), 1):
            line = json.dumps({"job": futures[future], "result": future.result()})
            file.write(line + "\n")
            file.flush()
            print(f"{number}/{len(futures)} {futures[future]}", flush=True)
            yield futures[future], json.loads(line)["result"]


if __name__ == "__main__":
    main()
