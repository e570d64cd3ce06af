"""The input of a job, and what its steps hand on to the next."""

from typing import Any

from slipstick.errors import WrongDigest

Order = dict[str, Any]
"""The input of a job, as the service submits it (service/job_store.py)."""
Checkpoint = dict[str, Any]
"""The output of a step: a state, and the time spent so far in each stage (worker/clocks.py)."""


def require_same(order: Order, kind: str, digest: str, job: str) -> None:
    """Raise `WrongDigest` if a file of the job has changed since the submission.

    `kind` is table, recordings, bench (its physics), or sensing (sensors and priors of the bench).
    """
    if digest != order[f"{kind}_digest"]:
        changed = "sensors or priors of the bench" if kind == "sensing" else f"{kind} '{order[kind]}'"
        raise WrongDigest(f"The {changed} changed after the {job} was submitted", f"Submit the {job} again")
