"""A calibration as a durable workflow: killed at any moment, it begins anew and gives the same result."""

from collections.abc import Mapping
from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from . import calibration_steps
from .jobs import Computers, compute, compute_whole
from .orders import Order, file_of_machine


def register(computers: Computers, machines: Mapping[str, str], dask: str | None = None) -> None:
    """Register the DBOS workflow `calibration`, before `DBOS.launch`.

    `machines` are the paths of the declared machines that the worker was given, by name; many runs of them
    are computed on the Dask scheduler at the address `dask`, if there is one.
    """

    @DBOS.step(name="calibration.machine")
    def machine(order: Order) -> dict[str, Any]:
        return compute_whole(computers, calibration_steps.calibrate_declared, file_of_machine(machines, order), dask,
                             order=order, before="the parameters were fitted")

    @DBOS.step(name="calibration.bench")
    def bench(order: Order) -> dict[str, Any]:
        return compute(computers, calibration_steps.calibrate_bench, order)

    @DBOS.workflow(name="calibration", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        return machine(order) if order["machine"] else bench(order)
