"""A build as a durable workflow: killed at any moment, it goes on with the chunks that are done."""

from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from slipstick.time_budget import TimeBudgetEnded

from . import build_steps
from .computing import TimeEnded
from .jobs import Computers, compute
from .orders import Order, time_left
from .simulators import Simulators


def register(computers: Computers, simulators: Simulators) -> None:
    """Register the DBOS workflow `build`, before `DBOS.launch`; only `simulators` are run beside benches."""
    files = tuple(simulators.machines.values())

    @DBOS.step(name="build.table")
    def table(order: Order) -> dict[str, Any]:
        try:
            return compute(computers, build_steps.build_table, files, simulators.dask, order,
                           seconds=time_left(order, {}))
        except TimeEnded:
            raise TimeBudgetEnded.before(order["time_budget"], "the table was complete") from None

    @DBOS.workflow(name="build", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        return table(order)
