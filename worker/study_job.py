"""A study as a durable workflow: killed at any moment, it resumes after its last step and gives the same result.

When the time budget ends, the step that runs is stopped, and what was named by then is the result.
"""

from collections.abc import Mapping
from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from . import study_steps
from .computing import TimeEnded
from .jobs import Computers, compute
from .orders import Checkpoint, Order, file_of_machine, time_left, with_time


def register(computers: Computers, machines: Mapping[str, str], dask: str | None = None) -> None:
    """Register the DBOS workflow `study`, before `DBOS.launch`.

    `machines` are the paths of the declared machines that the worker was given, by name: the service names none. Their
    studies compute with many runs on the Dask scheduler at the address `dask`, if there is one.
    """

    @DBOS.step(name="study.machine")
    def machine(order: Order) -> dict[str, Any]:
        file = file_of_machine(machines, order)
        try:
            return compute(computers, study_steps.study_declared, file, dask, order, seconds=time_left(order, {}))
        except TimeEnded as ended:
            return study_steps.end_declared(order, ended.kept, ended.seconds)

    @DBOS.step(name="study.name")
    def name(order: Order) -> Checkpoint:
        try:
            return compute(computers, study_steps.name, order, seconds=time_left(order, {}))
        except TimeEnded as ended:
            return {**(ended.kept or {}), **with_time({}, "name", ended.seconds)}

    @DBOS.step(name="study.confirm")
    def confirm(order: Order, checkpoint: Checkpoint) -> dict[str, Any]:
        try:
            if left := time_left(order, checkpoint):
                return compute(computers, study_steps.confirm, order, checkpoint, seconds=left)
        except TimeEnded as ended:
            checkpoint = {**checkpoint, **with_time(checkpoint, "confirm", ended.seconds)}
        return compute(computers, study_steps.deliver, order, checkpoint)

    @DBOS.workflow(name="study", serialization_type=WorkflowSerializationFormat.PORTABLE)
    def run(order: Order) -> dict[str, Any]:
        return machine(order) if order.get("machine") else confirm(order, name(order))
