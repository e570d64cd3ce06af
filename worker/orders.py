"""The input of a job, what its steps hand on to the next, and the time that they take."""

import argparse
import math
from collections.abc import Mapping
from typing import Any

from slipstick.bench import Bench
from slipstick.errors import InvalidValue, WrongDigest
from slipstick.machine import Runs
from slipstick.storage.library import Library
from slipstick.time_budget import DEFAULT, seconds_of

Order = dict[str, Any]
"""The input of a job, as the service submits it (service/job_store.py)."""
Checkpoint = dict[str, Any]
"""The output of a step: a state, and the time spent so far in each stage."""


def require_same(order: Order, kind: str, digest: str, job: str) -> None:
    """Raise `WrongDigest` if a file of the job has changed since the submission.

    `kind` is table, recordings, bench (its physics), or sensing (sensors and priors of the bench).
    """
    if digest != order[f"{kind}_digest"]:
        changed = "sensors or priors of the bench" if kind == "sensing" else f"{kind} '{order[kind]}'"
        raise WrongDigest(f"The {changed} changed after the {job} was submitted", f"Submit the {job} again")


def bench_of(library: Library, order: Order, job: str) -> Bench:
    """The bench of a job; raises `WrongDigest` if it has changed since the submission."""
    bench = library.bench(order["bench"])
    require_same(order, "bench", bench.digest, job)
    require_same(order, "sensing", bench.sensing_digest, job)
    return bench


def runs_of(library: Library, order: Order, job: str) -> Runs:
    """The runs of a declared machine of a job; raises `WrongDigest` if they have changed since the submission."""
    runs = library.recorded(order["recordings"])
    require_same(order, "recordings", runs.digest, job)
    if not isinstance(runs, Runs):
        raise InvalidValue(f"'{order['recordings']}' are no runs of a declared machine", f"Submit the {job} again")
    return runs


def file_of_machine(machines: Mapping[str, str], order: Order) -> str:
    """The path of the file of a job's declared machine, among those that the worker was given; raises `InvalidValue`.

    The service names no file, so that it cannot decide what the worker runs.
    """
    if order["machine"] not in machines:
        raise InvalidValue(f"This worker has no machine '{order['machine']}'",
                           "Start it with `work --machine FILE.py`, the file that declares the machine")
    return machines[order["machine"]]


def add_time_budget_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option of a command that delivers what it has when its time is over."""
    parser.add_argument("--time-budget", type=_seconds, default=DEFAULT, metavar="TIME",
                        help='time in s, or with a unit such as "2 min", after which the command ends at its next step '
                             "with a partial result of what it has (default: %(default)g, a day)")


def _seconds(text: str) -> float:
    try:
        budget: float | str = float(text)
    except ValueError:
        budget = text
    try:
        return seconds_of(budget)
    except InvalidValue as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def time_left(order: Order, checkpoint: Mapping[str, Any]) -> float:
    """Seconds that are left of the time budget of a job after the steps before `checkpoint`; infinite without one."""
    budget = order.get("time_budget")  # jobs of earlier versions have none
    return math.inf if budget is None else max(0.0, budget - sum(checkpoint.get("seconds", {}).values()))


def with_time(checkpoint: Mapping[str, Any], stage: str, seconds: float) -> dict[str, dict[str, float]]:
    """The `seconds` by stage of `checkpoint`, with those of a step of `stage` that was stopped."""
    previous: dict[str, float] = checkpoint.get("seconds", {})
    return {"seconds": {**previous, stage: previous.get(stage, 0.0) + seconds}}
