"""What all durable jobs share: the queue, the order, the checkpoint and the progress report.

A job is a DBOS workflow: killed at any moment, it resumes after its last completed step, whose output is stored as
JSON. The interrupted step is computed again from the same state, and gives the same result.
"""

from typing import Any

from dbos import DBOS

from slipstick.errors import WrongDigest

QUEUE = "jobs"
"""Name of the only queue. Jobs of all kinds run one at a time, so that the processor time of a step is its own."""
_PROGRESS = "progress"

Order = dict[str, Any]
"""The input of a job, as the service submits it (service/job_store.py)."""
Checkpoint = dict[str, Any]
"""The output of a step: a state, and the time spent so far in each stage (worker/clocks.py)."""


def report(progress: dict[str, Any]) -> None:
    """Publish the progress of the running job. If the job has been cancelled, DBOS raises here and the step ends."""
    DBOS.set_event(_PROGRESS, progress)


def require_same(order: Order, kind: str, digest: str, job: str) -> None:
    """Raise `WrongDigest` if a file of the job has changed since the submission.

    `kind` is table, recordings, bench (its physics), or sensing (sensors and priors of the bench).
    """
    if digest != order[f"{kind}_digest"]:
        changed = "sensors or priors of the bench" if kind == "sensing" else f"{kind} '{order[kind]}'"
        raise WrongDigest(f"The {changed} changed after the {job} was submitted", f"Submit the {job} again")
