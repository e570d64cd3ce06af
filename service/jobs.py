"""What fits and studies share on the wire: id and key, submitting, status, and what is done."""

import datetime
import uuid
from typing import Any, Literal

from dbos import WorkflowStatus
from fastapi import Header, Path
from pydantic import BaseModel, Field

from service.job_store import JobStore, Order
from service.problem_details import Conflict

Status = Literal["queued", "running", "done", "failed", "cancelled"]

_STATUS: dict[str, Status] = {
    "DELAYED": "queued", "ENQUEUED": "queued", "PENDING": "running", "SUCCESS": "done", "ERROR": "failed",
    "MAX_RECOVERY_ATTEMPTS_EXCEEDED": "failed", "CANCELLED": "cancelled"}
_ID = r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$"


class Job(BaseModel):
    """What is known of any job without its progress and result."""

    id: str = Field(description="Its id.")
    status: Status = Field(description="queued, running, done, failed or cancelled.")
    note: str | None = Field(description="What to do where there is something to do.")
    problem: str | None = Field(description="Why it failed, and what to do.")
    recordings: str = Field(description="Name of the recordings.")
    recordings_digest: str = Field(description="Digest (SHA-256) of the recordings.")
    settings: dict[str, Any] = Field(description="All its settings.")
    submitted: datetime.datetime | None = Field(description="When it was submitted (UTC).")
    ended: datetime.datetime | None = Field(description="When it ended (UTC).")
    links: dict[str, str] = Field(description="What can be done with it -> address.")


def id_in_path(kind: str) -> Any:
    """The parameter of a path that names a job of a kind."""
    return Path(description=f"Id of the {kind}.", pattern=_ID, openapi_examples=_example(kind))


def idempotency_key(kind: str) -> Any:
    """The header that names a job of a kind before it is there."""
    return Header(alias="Idempotency-Key", pattern=_ID, openapi_examples=_example(kind),
                  description=f"Becomes the id of the {kind}. The same request with the same key is the same {kind}, "
                              "however often it is sent; another request with that key is a conflict. Without a key "
                              f"every request is a new {kind}.")


def _example(kind: str) -> Any:
    return {f"first-{kind}": {"summary": f"The {kind} of the example above", "value": f"first-{kind}"}}


def submit(store: JobStore, key: str | None, order: Order) -> WorkflowStatus:
    """The job of this key and order, which is put in the queue unless it is there; raises `Conflict`."""
    job = store.submit(key or str(uuid.uuid4()), order)
    if ordered(job) != order:
        raise Conflict(f"The key '{key}' belongs to a {store.workflow} with another request or other data",
                       "Send the request as it was then, or take another Idempotency-Key")
    return job


def ordered(job: WorkflowStatus) -> Order:
    """What the worker was told."""
    assert job.input is not None
    order: Order = job.input["args"][0]
    return order


def finished(store: JobStore, id: str) -> WorkflowStatus:
    """The job with its output; raises `UnknownName`, and `Conflict` where it is not done."""
    job = store.find(id)
    if job.status != "SUCCESS":
        status = _STATUS[job.status]
        open_still = status in ("queued", "running")
        remedy = "Ask again when it is done" if open_still else "Submit it again, under another key"
        raise Conflict(f"The {store.workflow} '{id}' has no result: it is {status}", remedy)
    return job


def output(job: WorkflowStatus) -> dict[str, Any]:
    """What the worker left of a finished job: `result`, `figure_data`, `seconds`, `processor_seconds`."""
    assert job.output is not None
    found: dict[str, Any] = job.output
    return found


def described(store: JobStore, job: WorkflowStatus, *links: str) -> dict[str, Any]:
    """The fields of `Job`, and those of its order, with `links` beside the one to itself."""
    status, here = _STATUS[job.status], f"{store.address}/{job.workflow_id}"
    waiting = "It waits for the worker; if none is running, start one with `python -m worker serve-jobs`"
    running = f"If its worker has ended, it goes on with `python -m worker serve-jobs --name {job.executor_id}`"
    return {
        **ordered(job), "id": job.workflow_id, "status": status,
        "note": {"queued": waiting, "running": running}.get(status),
        "problem": str(job.error) if job.error else None, "submitted": _time(job.created_at),
        "ended": _time(job.completed_at), "links": {"self": here, **{name: f"{here}/{name}" for name in links}}}


def _time(milliseconds: int | None) -> datetime.datetime | None:
    return None if milliseconds is None else datetime.datetime.fromtimestamp(milliseconds / 1000, datetime.UTC)
