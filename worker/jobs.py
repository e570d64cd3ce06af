"""A fit as a durable workflow on DBOS: killed at any moment, it goes on from its last block, bit for bit.

A block is the generations of about a second, one DBOS step: the state before it is stored, so a block cut off is
computed again from the same state, by arithmetic that depends on nothing else. How many generations fall into a block
depends on the clock; the result does not. The refinement, each interval, and the pictures' evidence are further steps.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from dbos import DBOS, WorkflowSerializationFormat

from slipstick.clutch.conditions import Conditions
from slipstick.clutch.model import Model
from slipstick.errors import WrongDigest
from slipstick.evidence import evidence
from slipstick.library import Library
from slipstick.problem import simulated_problem, table_problem
from slipstick.recordings import Recordings
from slipstick.uncertainty import fit, likelihood

QUEUE, WORKFLOW, PROGRESS = "fits", "fit", "progress"
_BLOCK_SECONDS = 1.0
_REPORT_SECONDS = 0.5

Order = dict[str, Any]
"""`table`, `table_digest`, `simulate`, `parameters`, `recordings`, `recordings_digest`, `outside`, `settings`
(service/job_store.py sends it)."""
Block = dict[str, Any]
"""`state` of the fit, its `estimate` once refined, and `seconds` and `processor_seconds` (of all threads) spent so far
in each stage."""
Clocks = tuple[float, float]


def register(library: Library) -> None:
    """Teach DBOS the workflow `fit` on the tables and recordings of `library`; call it before the launch."""

    @DBOS.step(name="start")
    def start(order: Order) -> Block:
        begun = _clocks()
        task = _open(library, order)
        return {"state": fit.start(task.settings, task.problem), **_spent({}, "open", begun)}

    @DBOS.step(name="search")
    def search(order: Order, block: Block) -> Block:
        begun = _clocks()
        task = _open(library, order)
        state = block["state"]
        while not fit.finished(task.settings, state) and time.perf_counter() < begun[0] + _BLOCK_SECONDS:
            state = fit.advance(task.settings, _watched(task, state, "search"), state)
            _report(task, state, "search")
        return {"state": state, **_spent(block, "search", begun)}

    @DBOS.step(name="refine")
    def refine(order: Order, block: Block) -> Block:
        begun = _clocks()
        task = _open(library, order)
        estimate = fit.refined(task.settings, _watched(task, block["state"], "refine"), block["state"])
        return {**block, "estimate": estimate, **_spent(block, "refine", begun)}

    @DBOS.step(name="interval")
    def interval(order: Order, block: Block) -> Block:
        begun = _clocks()
        task = _open(library, order)
        watched = _watched(task, block["state"], "intervals")
        estimate = fit.profile(task.settings, watched, block["estimate"])
        return {**block, "estimate": estimate, **_spent(block, "intervals", begun)}

    @DBOS.step(name="conclude")
    def conclude(order: Order, block: Block) -> dict[str, Any]:
        begun = _clocks()
        task = _open(library, order)
        watched = _watched(task, block["state"], "conclude")
        result = fit.conclude(task.settings, watched, block["state"], block["estimate"])
        shown = evidence(task.settings, watched, block["estimate"]["found"], task.model, task.recordings)
        return {"result": result, "evidence": shown, **_spent(block, "conclude", begun)}

    @DBOS.workflow(name=WORKFLOW, serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        settings = fit.FitSettings.from_dict(order["settings"])
        block = start(order)
        while not fit.finished(settings, block["state"]):
            block = search(order, block)
        block = refine(order, block)
        while not fit.profiled(settings, block["estimate"]):
            block = interval(order, block)
        return conclude(order, block)


@dataclass(frozen=True, eq=False)
class _Task:
    settings: fit.FitSettings
    problem: likelihood.Problem
    model: Model
    recordings: Recordings


class _Watched:
    """A model that reports now and then how often it was run."""

    def __init__(self, model: likelihood.Model, report: Callable[[int], None]) -> None:
        self.model, self.report = model, report
        self.runs, self.reported = 0, 0.0

    def __call__(self, points: np.ndarray, conditions: Conditions) -> np.ndarray:
        self.runs += 1
        if time.perf_counter() > self.reported + _REPORT_SECONDS:
            self.reported = time.perf_counter()
            self.report(self.runs)
        return self.model(points, conditions)


def _watched(task: _Task, state: fit.State, stage: str) -> likelihood.Problem:
    return replace(task.problem, model=_Watched(task.problem.model, lambda runs: _report(task, state, stage, runs)))


def _report(task: _Task, state: fit.State, stage: str, runs: int = 0) -> None:
    """Publish how far the fit is; where the fit has been cancelled, DBOS raises here and the step ends."""
    DBOS.set_event(PROGRESS, {"stage": stage, "model_runs": runs, **fit.progress(task.settings, task.problem, state)})


def _clocks() -> Clocks:
    """Of the wall, and of all threads of this process, in s."""
    return time.perf_counter(), time.process_time()


def _spent(block: Block, stage: str, begun: Clocks) -> Block:
    """Both times of `block`, with those of `stage` since `begun` added."""
    spent: Block = {}
    for name, begin, now in zip(("seconds", "processor_seconds"), begun, _clocks(), strict=True):
        before: dict[str, float] = block.get(name, {})
        spent[name] = {**before, stage: before.get(stage, 0.0) + now - begin}
    return spent


def _open(library: Library, order: Order) -> _Task:
    table, recordings = library.table(order["table"]), library.recording(order["recordings"])
    for kind, digest in (("table", table.digest), ("recordings", recordings.digest)):
        if digest != order[f"{kind}_digest"]:
            raise WrongDigest(f"The {kind} '{order[kind]}' changed after the fit was submitted", "Submit the fit again")
    problem = (simulated_problem(table.model, recordings, order["parameters"]) if order["simulate"]
               else table_problem(table, recordings, order["outside"], order["parameters"]))
    return _Task(fit.FitSettings.from_dict(order["settings"]), problem, table.model, recordings)
