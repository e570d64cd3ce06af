"""A fit as a durable workflow: killed at any moment, it resumes after its last step and gives bit-identical results.

A step of the search runs generations for about a second. Their number depends on the clock; the result does not. The
refinement, each interval and the conclusion with the figure data are further steps.
"""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from dbos import DBOS, WorkflowSerializationFormat

from slipstick.bench import Bench, Conditions
from slipstick.clutch.model import Model
from slipstick.figure_data import figure_data
from slipstick.inference import simulated_problem, table_problem
from slipstick.physical_values import physical_inputs
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.uncertainty import fit
from slipstick.uncertainty.likelihood import InferenceProblem, ShiftingTimeModel
from worker.clocks import clock_times, stage_times
from worker.jobs import Checkpoint, Order, report, require_same

_STEP_SECONDS = 1.0
_REPORT_SECONDS = 0.5


def register(library: Library) -> None:
    """Register the DBOS workflow `fit` on the tables and recordings of `library`, before `DBOS.launch`.

    A checkpoint holds the `state` of the search, and from the refinement on the `estimate`.
    """

    @DBOS.step(name="start")
    def start(order: Order) -> Checkpoint:
        begin = clock_times()
        task = _open(library, order)
        return {"state": fit.initial_state(task.settings, task.problem), **stage_times({}, "open", begin)}

    @DBOS.step(name="search")
    def search(order: Order, checkpoint: Checkpoint) -> Checkpoint:
        begin = clock_times()
        task = _open(library, order)
        state = checkpoint["state"]
        while not fit.is_finished(task.settings, state) and time.perf_counter() < begin[0] + _STEP_SECONDS:
            state = fit.next_state(task.settings, _reporting_problem(task, state, "search"), state)
            _report_progress(task, state, "search")
        return {"state": state, **stage_times(checkpoint, "search", begin)}

    @DBOS.step(name="refine")
    def refine(order: Order, checkpoint: Checkpoint) -> Checkpoint:
        begin = clock_times()
        task = _open(library, order)
        problem = _reporting_problem(task, checkpoint["state"], "refine")
        estimate = fit.refined_estimate(task.settings, problem, checkpoint["state"])
        return {**checkpoint, "estimate": estimate, **stage_times(checkpoint, "refine", begin)}

    @DBOS.step(name="interval")
    def interval(order: Order, checkpoint: Checkpoint) -> Checkpoint:
        begin = clock_times()
        task = _open(library, order)
        problem = _reporting_problem(task, checkpoint["state"], "intervals")
        estimate = fit.with_next_interval(task.settings, problem, checkpoint["estimate"])
        return {**checkpoint, "estimate": estimate, **stage_times(checkpoint, "intervals", begin)}

    @DBOS.step(name="conclude")
    def conclude(order: Order, checkpoint: Checkpoint) -> dict[str, Any]:
        begin = clock_times()
        task = _open(library, order)
        problem = _reporting_problem(task, checkpoint["state"], "conclude")
        result = fit.summary(task.settings, problem, checkpoint["state"], checkpoint["estimate"])
        figures = figure_data(task.settings, problem, checkpoint["state"], checkpoint["estimate"], task.model,
                              task.recordings)
        physical = physical_inputs(task.model, result["axes"], result["mean"], result["std"])
        return {"result": result, "physical": [asdict(entry) for entry in physical], "figure_data": figures,
                **stage_times(checkpoint, "conclude", begin)}

    @DBOS.workflow(name="fit", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        settings = fit.FitSettings.from_dict(order["settings"])
        checkpoint = start(order)
        while not fit.is_finished(settings, checkpoint["state"]):
            checkpoint = search(order, checkpoint)
        checkpoint = refine(order, checkpoint)
        while not fit.has_all_intervals(settings, checkpoint["estimate"]):
            checkpoint = interval(order, checkpoint)
        return conclude(order, checkpoint)


@dataclass(frozen=True, eq=False)
class _Task:
    settings: fit.FitSettings
    problem: InferenceProblem
    model: Model
    recordings: Recordings


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


def _reporting_problem(task: _Task, state: fit.SearchState, stage: str) -> InferenceProblem:
    model = _ReportingModel(task.problem.model, lambda runs: _report_progress(task, state, stage, runs))
    return replace(task.problem, model=model)


def _report_progress(task: _Task, state: fit.SearchState, stage: str, runs: int = 0) -> None:
    report({"stage": stage, "model_runs": runs, **fit.progress(task.settings, task.problem, state)})


def _open(library: Library, order: Order) -> _Task:
    table, recordings = library.table(order["table"]), library.recording(order["recordings"])
    require_same(order, "table", table.digest, "fit")
    require_same(order, "recordings", recordings.digest, "fit")
    problem = (simulated_problem(table.model, recordings, order["parameters"], _bench(library, order))
               if order["simulate"] else table_problem(table, recordings, order["outside"], order["parameters"]))
    return _Task(fit.FitSettings.from_dict(order["settings"]), problem, table.model, recordings)


def _bench(library: Library, order: Order) -> Bench:
    bench = library.bench(order["bench"])
    require_same(order, "bench", bench.digest, "fit")
    require_same(order, "sensing", bench.sensing_digest, "fit")
    return bench
