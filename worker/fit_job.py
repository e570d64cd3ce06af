"""A fit as a durable workflow: killed at any moment, it resumes after its last step and gives bit-identical results.

When the time budget ends, the step that runs is stopped, and what there is by then is the result. Only time of steps
that are in the database counts, so that a resumed job neither restarts nor skips its budget.
"""

from collections.abc import Callable
from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from slipstick.uncertainty import fit

from . import fit_steps
from .computing import TimeEnded
from .jobs import Computers, compute, compute_whole
from .orders import Checkpoint, Order, time_left, with_time
from .simulators import Simulators


def register(computers: Computers, simulators: Simulators) -> None:
    """Register the DBOS workflow `fit`, before `DBOS.launch`.

    Only `simulators` are run: a table names its simulator, but a file must not decide what this worker runs.
    """

    def within_budget(step: Callable[..., Checkpoint], stage: str, order: Order, checkpoint: Checkpoint) -> Checkpoint:
        """The checkpoint after a step, or what the step has when the time budget ends."""
        try:
            return compute(computers, step, simulators, order, checkpoint, seconds=time_left(order, checkpoint))
        except TimeEnded as ended:
            return {**checkpoint, **(ended.kept or {}), **with_time(checkpoint, stage, ended.seconds)}

    @DBOS.step(name="start")
    def start(order: Order) -> Checkpoint:
        return compute_whole(computers, fit_steps.start, simulators, order=order, before="the search began")

    @DBOS.step(name="search")
    def search(order: Order, checkpoint: Checkpoint) -> Checkpoint:
        return within_budget(fit_steps.search, "search", order, checkpoint)

    @DBOS.step(name="refine")
    def refine(order: Order, checkpoint: Checkpoint) -> Checkpoint:
        return within_budget(fit_steps.refine, "refine", order, checkpoint)

    @DBOS.step(name="interval")
    def interval(order: Order, checkpoint: Checkpoint) -> Checkpoint:
        return within_budget(fit_steps.interval, "intervals", order, checkpoint)

    @DBOS.step(name="conclude")
    def conclude(order: Order, checkpoint: Checkpoint) -> dict[str, Any]:
        return compute(computers, fit_steps.conclude, simulators, order, checkpoint)

    @DBOS.workflow(name="fit", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        settings = fit.FitSettings.from_dict(order["settings"])
        checkpoint = start(order)
        while time_left(order, checkpoint) and not fit.is_finished(settings, checkpoint["state"]):
            checkpoint = search(order, checkpoint)
        if time_left(order, checkpoint):
            checkpoint = refine(order, checkpoint)
        while time_left(order, checkpoint) and not fit.has_all_intervals(settings, checkpoint["estimate"]):
            checkpoint = interval(order, checkpoint)
        return conclude(order, checkpoint)
