"""What the routes of all jobs share: ids and idempotency keys, submission, status, and results."""

import datetime
import re
import threading
import uuid
from collections.abc import Callable, Mapping
from typing import Annotated, Any, TypeVar

import orjson
from dbos import WorkflowStatus
from fastapi import Query, Request
from pydantic import BaseModel, BeforeValidator, Field
from starlette.concurrency import run_in_threadpool

from slipstick.storage.library import Library
from slipstick.storage.queues import name_machine_queue
from slipstick.time_budget import TimeBudgetEnded

from .following import Following
from .held import held
from .job_filter import ACTIVE, ENDED, STATUS, JobFilter, Status
from .job_store import JobInput, JobStore
from .problem_details import Conflict

_SUBMITTING = threading.Lock()
"""Held by the request that submits a job: of two with the same key, only one must replace a job."""


TimeBudget = Annotated[float | None, Field(
    gt=0, description="Time in s that the job may compute; null for no limit. When it ends, what there is by then is "
                      "the result, marked as `partial`. A complete result does not depend on it.")]
BudgetLeft = Annotated[float | None, Field(
    description="What is left of the time budget in s, as of this progress; null without a budget, and "
                "while the result is assembled.")]


class Job(BaseModel):
    """A job without its progress and result."""

    id: str = Field(description="Id of the job.")
    status: Status = Field(description="Status of the job.")
    note: str | None = Field(
        description="How to start or resume the worker that runs the job; null once the job has ended.")
    problem: str | None = Field(description="Cause of a failure, and its remedy; null unless the job failed.")
    time_budget: TimeBudget = None
    submitted: datetime.datetime | None = Field(description="Time of submission (UTC).")
    started: datetime.datetime | None = Field(
        description="Time at which a worker took the job from the queue (UTC), the last time if it was resumed; null "
                    "while it is queued and after it was cancelled.")
    ended: datetime.datetime | None = Field(description="Time at which the job ended (UTC); null before that.")
    links: dict[str, str] = Field(description="Addresses of the job and of its result, report and so on, by name.")


JobStores = Annotated[Mapping[str, JobStore], held("jobs")]
"""The jobs of each kind."""


class RecordedJob(Job):
    """A job on recordings, and on their bench if it needs one."""

    recordings: str = Field(description="Name of the recordings.")
    recordings_digest: str = Field(description="SHA-256 digest of the recordings.")
    bench: str | None = Field(description="Name of the bench; null if none was needed, and for runs of a declared "
                                          "machine.")
    bench_digest: str | None = Field(description="SHA-256 digest of the physics of the bench.")
    sensing_digest: str | None = Field(description="SHA-256 digest of the sensors and priors of the bench.")


AllSettings = Annotated[dict[str, Any], Field(  # clients name its class by the title, and StudySettings exists
    title="All settings", description="All settings of the job, including default values. Those of a study of a "
                                      "declared machine are submitted as `engine`.")]
MachineOfRuns = Annotated[str | None, Field(description="Name of the declared machine; null for a bench.")]


class Progress(BaseModel):
    """What a running job is doing."""

    doing: str = Field(description="What it is doing, in words.")
    done: float | None = Field(description="Share that is complete, from 0 to 1; null where it is not known.")
    budget_left: BudgetLeft = None


StatusFilter = Annotated[list[Status] | None, Query(
    alias="status", description="Only jobs with this status; repeat the parameter for several.", max_length=5)]
RecordingsFilter = Annotated[str | None, Query(alias="recordings", description="Only jobs of these recordings.")]


def _require_date(text: Any) -> Any:
    """Refuse numbers, which would be read as seconds since 1970."""
    if isinstance(text, str) and not re.match(r"\d{4}-\d\d-\d\d", text):
        raise ValueError("A time begins with a date, such as 2026-09-21T14:00:00Z")
    return text


SinceFilter = Annotated[datetime.datetime | None, BeforeValidator(_require_date), Query(
    alias="since", description="Only jobs submitted at this time or later, such as 2026-09-21T14:00:00Z.")]
TextFilter = Annotated[str | None, Query(
    alias="text", max_length=200, description="Only jobs with this text, in small or capital letters, in their id or "
                                              "in the name of a file of theirs.")]


async def job_filter(status: StatusFilter = None, recordings: RecordingsFilter = None, since: SinceFilter = None,
                     text: TextFilter = None) -> JobFilter:
    """The filter of a list of jobs. A time without offset is UTC."""
    if since is not None and since.tzinfo is None:
        since = since.replace(tzinfo=datetime.UTC)
    return JobFilter(status, since, recordings, text=text)


Ahead = Annotated[int | None, Field(description="Number of jobs before this one in its queue, that of short jobs, of "
                                                 "long jobs, or of its machine; null unless it is queued.")]


MissingMachine = Annotated[str | None, Field(
    description="Machine that the job waits for: it is queued, and no running worker has the file of this machine; "
                "null otherwise.")]


def submit(store: JobStore, key: str | None, job_input: JobInput, queue: str,
           check: Callable[[], None] = lambda: None) -> WorkflowStatus:
    """Enqueue a job, or return the existing job with this key and this input; raises `Conflict`.

    A job whose input names a machine is in the queue of this machine, and any other one in the `queue`.
    `check` is called before a new job, and may raise.

    Limits do not count, as complete results do not depend on them. A job that it has ended is replaced:
    its result depends on the clock, and is not used again.
    """
    id = key or str(uuid.uuid4())
    job_input = orjson.loads(orjson.dumps(job_input))  # as the database returns it: with lists instead of tuples
    queue = name_machine_queue(job_input["machine"]) if job_input.get("machine") else queue
    with _SUBMITTING:
        if not store.has(id):
            check()
        job = store.submit(id, job_input, queue)
        is_same = _without_limits(input_of(job)) == _without_limits(job_input)
        if is_same and _has_run_out_of_time(job):
            store.delete(id)
            job = store.submit(id, job_input, queue)
    if not is_same:
        raise Conflict(f"The Idempotency-Key '{key}' is in use for a {store.workflow} with a different request or "
                       "different data", "Repeat the original request, or use a different Idempotency-Key")
    return job


def _has_run_out_of_time(job: WorkflowStatus) -> bool:
    return is_partial(job) or getattr(job.error, "name", None) == TimeBudgetEnded.__name__


def _without_limits(job_input: JobInput) -> JobInput:
    return {name: value for name, value in job_input.items() if name not in ("time_budget", "most_runs")}


_J = TypeVar("_J", bound=Job)


async def wait_for_end(following: Following, request: Request, key: str, read: Callable[[], _J], seconds: int) -> _J:
    """Return the job as soon as it has ended, or after `seconds` s; raises `Busy` if too many clients wait."""
    if seconds == 0:
        return await run_in_threadpool(read)
    with following.place():
        async for job in following.states(key, read, seconds):
            if job.status in ENDED or await request.is_disconnected():
                break
    return job


def delete(store: JobStore, id: str) -> JobInput:
    """Delete a job that has ended, and return its input; raises `UnknownName`, and `Conflict` if it has not ended."""
    job = store.find(id)
    status = STATUS[job.status]
    if status in ACTIVE:
        raise Conflict(f"The {store.workflow} '{id}' is {status}", f"POST {store.address}/{id}/cancel first")
    store.delete(id)
    return input_of(job)


def input_of(job: WorkflowStatus) -> JobInput:
    """Return the input with which a job was submitted."""
    assert job.input is not None
    job_input: JobInput = job.input["args"][0]
    return job_input


def finished_job(store: JobStore, id: str, *, output: bool = True) -> WorkflowStatus:
    """Return a finished job, without its `output` on request; raises `UnknownName`, and `Conflict` if it is not done.
    """
    job = store.find(id, output=output)
    if job.status != "SUCCESS":
        status = STATUS[job.status]
        remedy = "Repeat this request when its status is `done`" if status in ACTIVE else \
            "Submit it again with a different Idempotency-Key"
        raise Conflict(f"The {store.workflow} '{id}' has no result: its status is `{status}`", remedy)
    return job


def version_of(*jobs: WorkflowStatus) -> str:
    """Return what changes if one of these finished jobs is replaced by another one of the same id."""
    return " ".join(f"{job.workflow_id} {job.completed_at}" for job in jobs)


def output_of(job: WorkflowStatus) -> dict[str, Any]:
    """Return the output of a finished job: `result`, `figure_data`, `seconds`, `processor_seconds`."""
    assert job.output is not None
    output: dict[str, Any] = job.output
    return output


def is_of_machine(job: WorkflowStatus) -> bool:
    """Return whether a job is one of runs of a declared machine."""
    return bool(input_of(job).get("machine"))


def is_partial(job: WorkflowStatus) -> bool:
    """Return whether the time budget of a job ended before its result was complete."""
    return job.status == "SUCCESS" and bool(output_of(job)["result"].get("partial"))


def require_complete(store: JobStore, job: WorkflowStatus) -> None:
    """Raise `Conflict` if the result of a finished job is partial."""
    if is_partial(job):
        raise Conflict(f"The result of the {store.workflow} '{job.workflow_id}' is partial: its time budget ended",
                       "Submit it again with a larger `time_budget`")


def bench_input(library: Library, name: str | None) -> dict[str, Any]:
    """The bench of a job as part of its input: name and both digests, null without a bench."""
    bench = None if name is None else library.bench(name)
    return {"bench": name, "bench_digest": bench and bench.digest, "sensing_digest": bench and bench.sensing_digest}


def job_fields(store: JobStore, job: WorkflowStatus, *links: str) -> dict[str, Any]:
    """Return the fields of `Job` and of the job's input, with `links` to the named sub-resources."""
    status, address = STATUS[job.status], f"{store.address}/{job.workflow_id}"
    queued = "Waiting for a worker. If none is running, start one with `slipstick work`"
    running = (f"If its worker '{job.executor_id}' stops, another one takes over within 10 s; /v1/health says how many "
               "are alive. Start one with `slipstick work`")
    return {
        **input_of(job), "id": job.workflow_id, "status": status,
        "note": {"queued": queued, "running": running}.get(status),
        "problem": str(job.error) if job.error else None, "submitted": _utc(job.created_at),
        "started": None if status == "queued" else _utc(job.dequeued_at),
        "ended": _utc(job.completed_at), "links": {"self": address, **{name: f"{address}/{name}" for name in links}}}


def _utc(milliseconds: int | None) -> datetime.datetime | None:
    return None if milliseconds is None else datetime.datetime.fromtimestamp(milliseconds / 1000, datetime.UTC)
