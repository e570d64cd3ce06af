"""A calibration as a durable workflow: killed at any moment, it begins anew and gives the same result."""

from collections.abc import Mapping
from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from slipstick.time_budget import TimeBudgetEnded

from . import calibration_steps
from .computing import TimeEnded
from .jobs import Computers, compute
from .orders import Order, file_of_machine, time_left


def register(computers: Computers, machines: Mapping[str, str], dask: str | None = None) -> None:
    """Register the DBOS workflow `calibration`, before `DBOS.launch`.

    `machines` are the paths of the declared machines that the worker was given, by name; many runs of them
    are computed on the Dask scheduler at the address `dask`, if there is one.
    """

    @DBOS.step(name="calibration.machine")
    def machine(order: Order) -> dict[str, Any]:
        file = file_of_machine(machines, order)
        try:
            return compute(computers, calibration_steps.calibrate_declared, file, dask, order,
                           seconds=time_left(order, {}))
        except TimeEnded:
            raise TimeBudgetEnded.before(order["time_budget"], "the parameters were fitted") from None

    @DBOS.step(name="calibration.bench")
    def bench(order: Order) -> dict[str, Any]:
        return compute(computers, calibration_steps.calibrate_bench, order)

    @DBOS.workflow(name="calibration", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        return machine(order) if order["machine"] else bench(order)
