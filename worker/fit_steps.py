"""The steps of a fit, each a function of the library and of the state in which the step before it left the fit.

A step of the search runs generations for about a second. Their number depends on the clock; the result does not. The
refinement, each interval and the conclusion with the figure data are further steps. A checkpoint holds the `state` of
the search, and from the refinement on the `estimate`, unless the time budget ended before.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slipstick.bench import Conditions
from slipstick.black_box import BlackBoxDescription
from slipstick.inference.fitting import FitTask
from slipstick.inference.problems import machine_problem, require_reach, simulated_problem, table_problem
from slipstick.plausibility.mismatch import require_match
from slipstick.storage.library import Library
from slipstick.table.subject import output_of
from slipstick.time_budget import clock_times, stage_times
from slipstick.uncertainty import fit
from slipstick.uncertainty.likelihood import InferenceProblem, ShiftingTimeModel

from .computing import Report
from .orders import Checkpoint, Order, bench_of, require_same
from .simulators import Simulators

_STEP_SECONDS = 1.0
_REPORT_SECONDS = 0.5


def start(library: Library, report: Report, simulators: Simulators, order: Order) -> Checkpoint:
    """The state before the first generation; a simulator is compiled here, at its first use, not in the search.

    Raises `InvalidValue` for recordings that cannot be of what is simulated.
    """
    begin = clock_times()
    task = _open(library, simulators, order)
    state = fit.initial_state(task.settings, task.problem)
    if order["simulate"]:
        require_reach(_Progress(task, report, "start").problem(state), output_of(task.model))
        if not isinstance(task.model, BlackBoxDescription):
            require_match(library.recording(order["recordings"]), bench_of(library, order, "fit"), task.model)
    return {"state": state, **stage_times({}, "open", begin)}


def search(library: Library, report: Report, simulators: Simulators, order: Order,
           checkpoint: Checkpoint) -> Checkpoint:
    """Some generations."""
    begin = clock_times()
    task = _open(library, simulators, order)
    state, before = checkpoint["state"], checkpoint["seconds"].get("search", 0.0)
    progress = _Progress(task, report, "search", lambda: before + time.perf_counter() - begin[0])
    while not fit.is_finished(task.settings, state) and time.perf_counter() < begin[0] + _STEP_SECONDS:
        state = fit.next_state(task.settings, progress.problem(state), state)
        report.keep({"state": state, **stage_times(checkpoint, "search", begin)})
        progress(state)
    return {"state": state, **stage_times(checkpoint, "search", begin)}


def refine(library: Library, report: Report, simulators: Simulators, order: Order,
           checkpoint: Checkpoint) -> Checkpoint:
    """The refined estimate."""
    begin = clock_times()
    task = _open(library, simulators, order)
    problem = _Progress(task, report, "refine").problem(checkpoint["state"])
    estimate = fit.refined_estimate(task.settings, problem, checkpoint["state"])
    return {**checkpoint, "estimate": estimate, **stage_times(checkpoint, "refine", begin)}


def interval(library: Library, report: Report, simulators: Simulators, order: Order,
             checkpoint: Checkpoint) -> Checkpoint:
    """One more interval."""
    begin = clock_times()
    task = _open(library, simulators, order)
    problem = _Progress(task, report, "intervals").problem(checkpoint["state"])
    estimate = fit.with_next_interval(task.settings, problem, checkpoint["estimate"])
    return {**checkpoint, "estimate": estimate, **stage_times(checkpoint, "intervals", begin)}


def conclude(library: Library, report: Report, simulators: Simulators, order: Order,
             checkpoint: Checkpoint) -> dict[str, Any]:
    """The output of the job, of which all steps before are complete or the time budget has ended.

    Raises `TimeBudgetEnded` if there is no generation. Without an estimate, that is the best candidate of the search.
    """
    begin = clock_times()
    task, state = _open(library, simulators, order), checkpoint["state"]
    reporting = replace(task, problem=_Progress(task, report, "conclude").problem(state))
    return {**reporting.output(state, checkpoint.get("estimate"), order["time_budget"]),
            **stage_times(checkpoint, "conclude", begin)}


class _ReportingModel:
    """A model that counts its runs and reports their number every half second."""

    def __init__(self, model: ShiftingTimeModel, report: Callable[[int], None]) -> None:
        self.model, self.report = model, report
        self.runs, self.last_report = 0, 0.0

    def __call__(self, points: np.ndarray, conditions: Conditions) -> np.ndarray:
        self.runs += 1
        if time.perf_counter() > self.last_report + _REPORT_SECONDS:
            self.last_report = time.perf_counter()
            self.report(self.runs)
        return self.model(points, conditions)


@dataclass(frozen=True, eq=False)
class _Progress:
    """What a step reports: its `stage`, and of the search how long it has taken so far in s."""

    task: FitTask
    report: Report
    stage: str
    seconds: Callable[[], float] | None = None

    def __call__(self, state: fit.SearchState, runs: int = 0) -> None:
        progress = fit.progress(self.task.settings, self.task.problem, state)
        done, most = progress["generation"], progress["generations"]
        left = self.seconds() / done * (most - done) if self.seconds and done else None
        self.report({"stage": self.stage, "model_runs": runs, "done": done / most, "seconds_left": left, **progress})

    def problem(self, state: fit.SearchState) -> InferenceProblem:
        """The problem of the task, whose model reports its runs."""
        model = _ReportingModel(self.task.problem.model, lambda runs: self(state, runs))
        return replace(self.task.problem, model=model)


def _open(library: Library, simulators: Simulators, order: Order) -> FitTask:
    table, recordings = library.table(order["table"]), library.measured(order["recordings"])
    require_same(order, "table", table.digest, "fit")
    require_same(order, "recordings", recordings.digest, "fit")
    if not order["simulate"]:
        problem = table_problem(table, recordings, order["outside"], order["parameters"])
    elif isinstance(table.model, BlackBoxDescription):
        problem = machine_problem(table.model, simulators.of_machine(table.model, order["parameters"]), recordings,
                                  order["parameters"])
    else:
        problem = simulated_problem(table.clutch, library.recording(order["recordings"]), order["parameters"],
                                    bench_of(library, order, "fit"), simulators.of_clutch)
    return FitTask(fit.FitSettings.from_dict(order["settings"]), problem, table.model, recordings)
