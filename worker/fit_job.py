"""A fit as a durable workflow: killed at any moment, it goes on from its last step, bit for bit.

The generations of about a second are one step. How many fall into it depends on the clock; the result does not. The
refinement, each interval, and the pictures' data are further steps.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from dbos import DBOS, WorkflowSerializationFormat

from slipstick.bench.conditions import Conditions
from slipstick.clutch.model import Model
from slipstick.figure_data import figure_data
from slipstick.inference import simulated_problem, table_problem
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.uncertainty import fit
from slipstick.uncertainty.likelihood import InferenceProblem, ShiftingTimeModel
from worker.clocks import clocks, spent
from worker.jobs import Block, Order, report, require_same

_BLOCK_SECONDS = 1.0
_REPORT_SECONDS = 0.5


def register(library: Library) -> None:
    """Teach DBOS the workflow `fit` on the tables and recordings of `library`; call it before the launch.

    A block holds the `state` of the fit, and its `estimate` once refined.
    """

    @DBOS.step(name="start")
    def start(order: Order) -> Block:
        begun = clocks()
        task = _open(library, order)
        return {"state": fit.initial_state(task.settings, task.problem), **spent({}, "open", begun)}

    @DBOS.step(name="search")
    def search(order: Order, block: Block) -> Block:
        begun = clocks()
        task = _open(library, order)
        state = block["state"]
        while not fit.is_finished(task.settings, state) and time.perf_counter() < begun[0] + _BLOCK_SECONDS:
            state = fit.next_state(task.settings, _watched(task, state, "search"), state)
            _report(task, state, "search")
        return {"state": state, **spent(block, "search", begun)}

    @DBOS.step(name="refine")
    def refine(order: Order, block: Block) -> Block:
        begun = clocks()
        task = _open(library, order)
        estimate = fit.refined_estimate(task.settings, _watched(task, block["state"], "refine"), block["state"])
        return {**block, "estimate": estimate, **spent(block, "refine", begun)}

    @DBOS.step(name="interval")
    def interval(order: Order, block: Block) -> Block:
        begun = clocks()
        task = _open(library, order)
        watched = _watched(task, block["state"], "intervals")
        estimate = fit.with_next_interval(task.settings, watched, block["estimate"])
        return {**block, "estimate": estimate, **spent(block, "intervals", begun)}

    @DBOS.step(name="conclude")
    def conclude(order: Order, block: Block) -> dict[str, Any]:
        begun = clocks()
        task = _open(library, order)
        watched = _watched(task, block["state"], "conclude")
        result = fit.summary(task.settings, watched, block["state"], block["estimate"])
        shown = figure_data(task.settings, watched, block["estimate"]["vector"], task.model, task.recordings)
        return {"result": result, "figure_data": shown, **spent(block, "conclude", begun)}

    @DBOS.workflow(name="fit", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        settings = fit.FitSettings.from_dict(order["settings"])
        block = start(order)
        while not fit.is_finished(settings, block["state"]):
            block = search(order, block)
        block = refine(order, block)
        while not fit.has_all_intervals(settings, block["estimate"]):
            block = interval(order, block)
        return conclude(order, block)


@dataclass(frozen=True, eq=False)
class _Task:
    settings: fit.FitSettings
    problem: InferenceProblem
    model: Model
    recordings: Recordings


class _Watched:
    """A model that reports now and then how often it was run."""

    def __init__(self, model: ShiftingTimeModel, report: Callable[[int], None]) -> None:
        self.model, self.report = model, report
        self.runs, self.reported = 0, 0.0

    def __call__(self, points: np.ndarray, conditions: Conditions) -> np.ndarray:
        self.runs += 1
        if time.perf_counter() > self.reported + _REPORT_SECONDS:
            self.reported = time.perf_counter()
            self.report(self.runs)
        return self.model(points, conditions)


def _watched(task: _Task, state: fit.SearchState, stage: str) -> InferenceProblem:
    return replace(task.problem, model=_Watched(task.problem.model, lambda runs: _report(task, state, stage, runs)))


def _report(task: _Task, state: fit.SearchState, stage: str, runs: int = 0) -> None:
    report({"stage": stage, "model_runs": runs, **fit.progress(task.settings, task.problem, state)})


def _open(library: Library, order: Order) -> _Task:
    table, recordings = library.table(order["table"]), library.recording(order["recordings"])
    require_same(order, "table", table.digest, "fit")
    require_same(order, "recordings", recordings.digest, "fit")
    problem = (simulated_problem(table.model, recordings, order["parameters"]) if order["simulate"]
               else table_problem(table, recordings, order["outside"], order["parameters"]))
    return _Task(fit.FitSettings.from_dict(order["settings"]), problem, table.model, recordings)
