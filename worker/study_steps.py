"""The steps of a study, `examine` and `conclude` of `slipstick.studies`; each takes some seconds to some minutes.

The checkpoint between both holds what is `named`.
"""

import time
from dataclasses import asdict, dataclass
from typing import Any

from slipstick.bench import Bench
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.studies import StudySettings, conclude, examine, unconfirmed
from slipstick.studies.progress import Log, StudyProgress
from slipstick.time_budget import clock_times, stage_times

from .computing import Report
from .orders import Checkpoint, Order, require_same

_REPORT_SECONDS = 0.5


def name(library: Library, report: Report, order: Order) -> Checkpoint:
    """What the blocks of the model say is missing."""
    begin, task = clock_times(), _open(library, order)
    named = examine(task.settings, task.bench, task.recordings, _log(report),
                    lambda named: report.keep({"named": named, **stage_times({}, "name", begin)}))
    return {"named": named, **stage_times({}, "name", begin)}


def confirm(library: Library, report: Report, order: Order, checkpoint: Checkpoint) -> dict[str, Any]:
    """The output of the job."""
    begin, task = clock_times(), _open(library, order)
    result, figures = conclude(task.settings, task.bench, task.recordings, checkpoint["named"], _log(report))
    return {"result": asdict(result), "figure_data": asdict(figures), **stage_times(checkpoint, "confirm", begin)}


def deliver(library: Library, report: Report, order: Order, checkpoint: Checkpoint) -> dict[str, Any]:
    """The output of a job whose time budget has ended before `confirm`; raises `TimeBudgetEnded` if nothing is named.
    """
    task = _open(library, order)
    result, figures = unconfirmed(task.settings, task.bench, task.recordings, checkpoint.get("named"),
                                  order["time_budget"])
    return {"result": asdict(result), "figure_data": asdict(figures), "seconds": checkpoint["seconds"],
            "processor_seconds": checkpoint.get("processor_seconds", {})}


@dataclass(frozen=True, eq=False)
class _Task:
    settings: StudySettings
    bench: Bench
    recordings: Recordings


def _log(report: Report) -> Log:
    """Report each step when it begins, and within a step at most twice a second what is tried."""
    step, last = 0, 0.0

    def log(progress: StudyProgress) -> None:
        nonlocal step, last
        if progress.step != step or time.monotonic() > last + _REPORT_SECONDS:
            step, last = progress.step, time.monotonic()
            report(asdict(progress))

    return log


def _open(library: Library, order: Order) -> _Task:
    recordings = library.recording(order["recordings"])
    require_same(order, "recordings", recordings.digest, "study")
    bench = library.bench(order["bench"])
    require_same(order, "bench", bench.digest, "study")
    require_same(order, "sensing", bench.sensing_digest, "study")
    return _Task(StudySettings.from_dict(order["settings"]), bench, recordings)
