"""What every durable job has in common: its queue, its order, and the word on how far it is.

A job is a workflow on DBOS: killed at any moment, it goes on from its last step, whose outcome is stored as JSON. What
was cut off is computed again from the same state, by arithmetic that depends on nothing else.
"""

from typing import Any

from dbos import DBOS

from slipstick.errors import WrongDigest

QUEUE = "jobs"
"""One for all kinds of jobs: they run one at a time, and the processor time of a step is its own."""
_PROGRESS = "progress"

Order = dict[str, Any]
"""What a job is to do (service/job_store.py sends it)."""
Block = dict[str, Any]
"""What a step leaves: a state, and the time spent so far in each stage (worker/clocks.py)."""


def report(progress: dict[str, Any]) -> None:
    """Publish how far the job of the present step is; where it has been cancelled, DBOS raises here: the step ends."""
    DBOS.set_event(_PROGRESS, progress)


def require_same(order: Order, kind: str, digest: str, job: str) -> None:
    """Raise `WrongDigest` where the `kind` of file that a job names is no longer what it was submitted with."""
    if digest != order[f"{kind}_digest"]:
        raise WrongDigest(f"The {kind} '{order[kind]}' changed after the {job} was submitted",
                          f"Submit the {job} again")
