"""A fit as a durable workflow: killed at any moment, it resumes after its last step and gives bit-identical results."""

from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from slipstick.uncertainty import fit
from worker import fit_steps
from worker.jobs import Computers, compute
from worker.orders import Checkpoint, Order
from worker.simulators import Simulators


def register(computers: Computers, simulators: Simulators) -> None:
    """Register the DBOS workflow `fit`, before `DBOS.launch`.

    Only `simulators` are run: a table names its simulator, but a file must not decide what this worker runs.
    """

    @DBOS.step(name="start")
    def start(order: Order) -> Checkpoint:
        return compute(computers, fit_steps.start, simulators, order)

    @DBOS.step(name="search")
    def search(order: Order, checkpoint: Checkpoint) -> Checkpoint:
        return compute(computers, fit_steps.search, simulators, order, checkpoint)

    @DBOS.step(name="refine")
    def refine(order: Order, checkpoint: Checkpoint) -> Checkpoint:
        return compute(computers, fit_steps.refine, simulators, order, checkpoint)

    @DBOS.step(name="interval")
    def interval(order: Order, checkpoint: Checkpoint) -> Checkpoint:
        return compute(computers, fit_steps.interval, simulators, order, checkpoint)

    @DBOS.step(name="conclude")
    def conclude(order: Order, checkpoint: Checkpoint) -> dict[str, Any]:
        return compute(computers, fit_steps.conclude, simulators, order, checkpoint)

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
