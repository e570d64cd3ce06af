"""The steps of a study, `examine` and `conclude` of `slipstick.studies`; each takes some seconds to some minutes.

The checkpoint between both holds what is `named`.
"""

import time
from dataclasses import asdict
from typing import Any

from slipstick.bench import Bench
from slipstick.engine.settings import EngineSettings
from slipstick.machine import Machine
from slipstick.machine_studies import MachineFigures, MachineStudyResult, study_machine
from slipstick.machine_studies.study import Studied, end_early
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.studies import StudySettings, conclude, examine, unconfirmed
from slipstick.studies.progress import Log, StudyProgress
from slipstick.studies.record import from_dict
from slipstick.time_budget import TimeBudgetEnded, clock_times, stage_times

from .computing import Report
from .executors import cluster_at
from .orders import Checkpoint, Order, bench_of, require_same, runs_of

_REPORT_SECONDS = 0.5


def name(library: Library, report: Report, order: Order) -> Checkpoint:
    """What the blocks of the model say is missing."""
    begin, task = clock_times(), _open(library, order)
    named = examine(*task, _log(report), lambda named: report.keep({"named": named, **stage_times({}, "name", begin)}))
    return {"named": named, **stage_times({}, "name", begin)}


def confirm(library: Library, report: Report, order: Order, checkpoint: Checkpoint) -> dict[str, Any]:
    """The output of the job."""
    begin, task = clock_times(), _open(library, order)
    result, figures = conclude(*task, checkpoint["named"], _log(report))
    return {"result": asdict(result), "figure_data": asdict(figures), **stage_times(checkpoint, "confirm", begin)}


def deliver(library: Library, report: Report, order: Order, checkpoint: Checkpoint) -> dict[str, Any]:
    """The output of a job whose time budget has ended before `confirm`; raises `TimeBudgetEnded` if nothing is named.
    """
    task = _open(library, order)
    result, figures = unconfirmed(*task, checkpoint.get("named"), order["time_budget"])
    return {"result": asdict(result), "figure_data": asdict(figures), "seconds": checkpoint["seconds"],
            "processor_seconds": checkpoint.get("processor_seconds", {})}


def study_declared(library: Library, report: Report, machine: str, dask: str | None, order: Order) -> dict[str, Any]:
    """The output of the job of a declared machine, of whose file this is the path, by a Dask scheduler if given."""
    begin, runs = clock_times(), runs_of(library, order, "study")
    with cluster_at(dask) as executor:
        studied = study_machine(Machine.open(machine), runs, EngineSettings(**order["settings"]), _log(report),
                                lambda named: report.keep(_output(named)), executor)
    return {**_output(studied), **stage_times({}, "study", begin)}


def end_declared(order: Order, kept: dict[str, Any] | None, seconds: float) -> dict[str, Any]:
    """The output of that job if its time budget has ended; raises `TimeBudgetEnded` if nothing was kept."""
    budget = order["time_budget"]
    if kept is None:
        raise TimeBudgetEnded.before(budget, "the blocks of the machine were examined")
    studied = from_dict(MachineStudyResult, kept["result"]), from_dict(MachineFigures, kept["figure_data"])
    return {**_output(end_early(studied, budget)), "seconds": {"study": seconds}, "processor_seconds": {}}


def _output(studied: Studied) -> dict[str, Any]:
    result, figures = studied
    return {"result": asdict(result), "figure_data": asdict(figures)}


def _log(report: Report) -> Log:
    """Report each step when it begins, and within a step at most twice a second what is tried."""
    step, last = 0, 0.0

    def log(progress: StudyProgress) -> None:
        nonlocal step, last
        if progress.step != step or time.monotonic() > last + _REPORT_SECONDS:
            step, last = progress.step, time.monotonic()
            report(asdict(progress))

    return log


def _open(library: Library, order: Order) -> tuple[StudySettings, Bench, Recordings]:
    recordings = library.recording(order["recordings"])
    require_same(order, "recordings", recordings.digest, "study")
    return StudySettings.from_dict(order["settings"]), bench_of(library, order, "study"), recordings
