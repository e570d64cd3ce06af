"""A build as a durable workflow: killed at any moment, it goes on with the chunks that are done."""

from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from . import build_steps
from .jobs import Computers, compute_whole
from .orders import Order
from .simulators import Simulators


def register(computers: Computers, simulators: Simulators) -> None:
    """Register the DBOS workflow `build`, before `DBOS.launch`; only `simulators` are run beside benches."""
    files = tuple(simulators.machines.values())

    @DBOS.step(name="build.table")
    def table(order: Order) -> dict[str, Any]:
        return compute_whole(computers, build_steps.build_table, files, simulators.dask, order=order,
                             before="the table was complete")

    @DBOS.workflow(name="build", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        return table(order)
