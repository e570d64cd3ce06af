"""A fit as a durable workflow on DBOS: killed at any moment, it goes on from its last block, bit for bit.

A block is the generations of about a second, one DBOS step: the state before it is stored, so a block cut off is
computed again from the same state, by arithmetic that depends on nothing else. How many generations fall into a block
depends on the clock; the result does not.
"""

import time
from dataclasses import replace
from typing import Any

import numpy as np
from dbos import DBOS, WorkflowSerializationFormat

from slipstick.clutch.conditions import Conditions
from slipstick.errors import WrongDigest
from slipstick.library import Library
from slipstick.problem import table_problem
from slipstick.uncertainty import fit
from slipstick.uncertainty.likelihood import Model

QUEUE, WORKFLOW, PROGRESS = "fits", "fit", "progress"
_BLOCK_SECONDS = 1.0
_REPORT_SECONDS = 0.5

Order = dict[str, Any]
"""`table`, `table_digest`, `recordings`, `recordings_digest`, `outside`, `settings` (service/job_store.py sends it)."""
Block = dict[str, Any]
"""`state` of the fit and the `seconds` spent so far in each stage."""


def register(library: Library) -> None:
    """Teach DBOS the workflow `fit` on the tables and recordings of `library`; call it before the launch."""

    @DBOS.step(name="start")
    def start(order: Order) -> Block:
        begun = time.perf_counter()
        settings, problem = _open(library, order)
        state = fit.start(settings, len(problem.axes))
        return {"state": state, "seconds": {"open": time.perf_counter() - begun, "search": 0.0}}

    @DBOS.step(name="search")
    def search(order: Order, block: Block) -> Block:
        begun = time.perf_counter()
        settings, problem = _open(library, order)
        state = block["state"]
        while not fit.finished(settings, state) and time.perf_counter() < begun + _BLOCK_SECONDS:
            state = fit.advance(settings, problem, state)
            _report(settings, state, "search", 0)
        spent = block["seconds"]["search"] + time.perf_counter() - begun
        return {"state": state, "seconds": {**block["seconds"], "search": spent}}

    @DBOS.step(name="polish")
    def polish(order: Order, block: Block) -> dict[str, Any]:
        begun = time.perf_counter()
        settings, problem = _open(library, order)
        watched = replace(problem, model=_Watched(problem.model, settings, block["state"]))
        result = fit.conclude(settings, watched, block["state"])
        return {"result": result, "seconds": {**block["seconds"], "polish": time.perf_counter() - begun}}

    @DBOS.workflow(name=WORKFLOW, serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        settings = fit.FitSettings.from_dict(order["settings"])
        block = start(order)
        while not fit.finished(settings, block["state"]):
            block = search(order, block)
        return polish(order, block)


class _Watched:
    """A model that reports now and then how often it was run."""

    def __init__(self, model: Model, settings: fit.FitSettings, state: fit.State) -> None:
        self.model, self.settings, self.state = model, settings, state
        self.runs, self.reported = 0, 0.0

    def __call__(self, points: np.ndarray, conditions: Conditions) -> np.ndarray:
        self.runs += 1
        if time.perf_counter() > self.reported + _REPORT_SECONDS:
            self.reported = time.perf_counter()
            _report(self.settings, self.state, "polish", self.runs)
        return self.model(points, conditions)


def _report(settings: fit.FitSettings, state: fit.State, stage: str, runs: int) -> None:
    """Publish how far the fit is; where the fit has been cancelled, DBOS raises here and the step ends."""
    DBOS.set_event(PROGRESS, {"stage": stage, "polish_runs": runs, **fit.progress(settings, state)})


def _open(library: Library, order: Order) -> tuple[fit.FitSettings, fit.Problem]:
    table, recordings = library.table(order["table"]), library.recording(order["recordings"])
    for kind, digest in (("table", table.digest), ("recordings", recordings.digest)):
        if digest != order[f"{kind}_digest"]:
            raise WrongDigest(f"The {kind} '{order[kind]}' changed after the fit was submitted", "Submit the fit again")
    return fit.FitSettings.from_dict(order["settings"]), table_problem(table, recordings, order["outside"])
