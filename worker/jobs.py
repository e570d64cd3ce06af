"""What all durable jobs share: the queues, and steps that end when the job is cancelled.

A job is a DBOS workflow: killed at any moment, it resumes after its last completed step, whose output is stored as
JSON. The interrupted step is computed again from the same state, and gives the same result.
"""

import math
import time
from collections.abc import Callable, Mapping
from typing import Any

from dbos import DBOS, error

from slipstick.storage.queues import QUEUES
from slipstick.time_budget import TimeBudgetEnded

from .computing import Computer, TimeEnded
from .orders import Order, time_left

_PROGRESS = "progress"

Computers = Mapping[str, Computer]
"""The process for the steps of each queue."""


def compute(computers: Computers, step: Callable[..., dict[str, Any]], *arguments: Any,
            seconds: float = math.inf) -> dict[str, Any]:
    """Compute a step of the running job in the process of its queue; ends at once if the job is cancelled.

    Raises `TimeEnded` if the step takes more than so many `seconds`, those left of the time budget.
    """
    begin, id = time.monotonic(), DBOS.workflow_id
    assert id is not None
    queue = DBOS.list_workflows(workflow_ids=[id], load_input=False, load_output=False)[0].queue_name

    def require_wanted() -> None:
        listed = DBOS.list_workflows(workflow_ids=[id], load_input=False, load_output=False)
        if not listed or listed[0].status == "CANCELLED":
            raise error.DBOSWorkflowCancelledError(f"The job {id} is cancelled")

    def report(progress: dict[str, Any]) -> None:
        require_wanted()
        left = max(0.0, seconds - (time.monotonic() - begin))
        DBOS.set_event(_PROGRESS, {**progress, "budget_left": left if math.isfinite(left) else None})

    # A job without queue is one that this worker resumes at its start.
    computer = computers[queue or QUEUES[0]]
    result: dict[str, Any] = computer.run(step, *arguments, report=report, require_wanted=require_wanted,
                                             seconds=seconds)
    return result


def compute_whole(computers: Computers, step: Callable[..., dict[str, Any]], *arguments: Any, order: Order,
                  before: str) -> dict[str, Any]:
    """Compute a step, with the `order` last, that has no result before its end; raises `TimeBudgetEnded`."""
    try:
        return compute(computers, step, *arguments, order, seconds=time_left(order, {}))
    except TimeEnded:
        raise TimeBudgetEnded.before(order["time_budget"], before) from None
