"""A study as a durable workflow: killed at any moment, it resumes after its last step and gives the same result."""

from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from worker import study_steps
from worker.jobs import Computers, compute
from worker.orders import Checkpoint, Order


def register(computers: Computers) -> None:
    """Register the DBOS workflow `study`, before `DBOS.launch`."""

    @DBOS.step(name="study.name")
    def name(order: Order) -> Checkpoint:
        return compute(computers, study_steps.name, order)

    @DBOS.step(name="study.confirm")
    def confirm(order: Order, checkpoint: Checkpoint) -> dict[str, Any]:
        return compute(computers, study_steps.confirm, order, checkpoint)

    @DBOS.workflow(name="study", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        return confirm(order, name(order))
