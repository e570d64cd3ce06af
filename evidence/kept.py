"""Jobs whose results are kept, one line of JSON each, so that a killed run goes on where it was."""

import argparse
import json
import signal
from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from multiprocessing.context import BaseContext
from pathlib import Path
from typing import Any

from numba import set_num_threads

Job = tuple[Hashable, ...]
Result = dict[str, Any]
PROCESSES = 2


def open_processes(context: BaseContext | None = None) -> ProcessPoolExecutor:
    """Processes that answer jobs on one core each, and end with Ctrl-C without a traceback."""
    return ProcessPoolExecutor(PROCESSES, context, _begin)


def _begin() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    set_num_threads(1)


def run_jobs(run_job: Callable[..., Result], jobs: Sequence[Job], path: Path,
             open_executor: Callable[[], Executor]) -> Iterator[tuple[Job, Result]]:
    """Yield each job with its result as JSON has it: those in the file, then the others, which it gets as they end.

    The executor is opened only where jobs are left.
    """
    done = read_results(path)
    yield from ((job, done[job]) for job in jobs if job in done)
    left = [job for job in jobs if job not in done]
    if not left:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    with open_executor() as pool, path.open("a") as file:
        futures = {pool.submit(run_job, *job): job for job in left}
        for future in as_completed(futures):
            line = json.dumps({"job": futures[future], "result": future.result()})
            file.write(line + "\n")
            file.flush()
            yield futures[future], json.loads(line)["result"]


def read_results(path: Path) -> dict[Job, Result]:
    """Return the results that a file keeps, none if there is no file.

    The file is cut behind its last whole line: a program that was killed may have written a part of one.
    """
    if not path.exists():
        return {}
    content = path.read_bytes()
    whole = content[:content.rfind(b"\n") + 1]
    if whole != content:
        path.write_bytes(whole)
    lines = map(json.loads, whole.splitlines())
    return {tuple(line["job"]): line["result"] for line in lines}


def read_count(text: str) -> int:
    """Return a whole number of 1 or more; argparse reports the errors that are raised."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number of 1 or more")
    return number
