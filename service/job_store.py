"""The service's access to the job database: submit jobs, and read their progress and results.

The worker runs the jobs (worker/jobs.py). Service and worker share no code. They agree on the names below, on the
workflow names `fit` and `study`, and on the input of each workflow: a JSON object with `recordings`,
`recordings_digest`, `settings` and `time_budget`, to which a fit adds `table`, `table_digest`, `simulate`, `parameters`
and `outside`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dbos import DBOS, DBOSClient, WorkflowStatus, error

from slipstick.errors import InvalidValue, UnknownName
from slipstick.storage.database import open_database

from .job_filter import ACTIVE, STATUS, JobFilter
from .job_table import JobTable
from .problem_details import Conflict

PROGRESS = "progress"
APPLICATION = "slipstick"
KINDS = {"fit": "/v1/fits", "study": "/v1/studies", "calibration": "/v1/calibrations",
         "build": "/v1/builds"}
"""Workflow name of each kind of jobs -> the path of their list."""

JobInput = dict[str, Any]
_ALL = JobFilter()


def connect(url: str) -> DBOSClient:
    """Open the database at `url`, with the tables of the jobs. The caller closes it with `destroy()`.

    A SQLite file is made if it does not exist. Raises `InvalidValue` if the database cannot be opened.
    """
    open_database(url).dispose()
    DBOS.migrate(url)
    return DBOSClient(system_database_url=url, application_name=APPLICATION, retry_connection_errors=False)


@dataclass(frozen=True)
class JobStore:
    """The jobs of one kind: `workflow` is their workflow name in the database, `address` the path of their list."""

    client: DBOSClient
    table: JobTable
    workflow: str
    address: str

    def submit(self, id: str, job_input: JobInput, queue: str) -> WorkflowStatus:
        """Enqueue a job with the id `id`; if a job of this kind already has the id, return that job instead.

        Raises `Conflict` if a job of another kind has the id, and `InvalidValue` for a text with a NUL.
        """
        if _has_nul(job_input):  # of which PostgreSQL makes no JSON: no job could be searched by its input any more
            raise InvalidValue("A text of the request has the character U+0000", "Remove this character")
        try:
            self.client.enqueue({"workflow_name": self.workflow, "queue_name": queue, "workflow_id": id,
                                 "serialization_type": "portable"}, job_input)  # type: ignore[typeddict-item]
        except error.DBOSConflictingWorkflowError:
            raise Conflict(f"The Idempotency-Key '{id}' is in use for a job that is not a {self.workflow}",
                           "Use a different Idempotency-Key") from None
        return self.find(id)

    def find(self, id: str, *, output: bool = True) -> WorkflowStatus:
        """Return the job with the id `id`, without its `output` on request; raises `UnknownName`."""
        jobs = self.client.list_workflows(workflow_ids=[id], name=self.workflow, load_output=output)
        if not jobs:
            raise UnknownName(f"There is no {self.workflow} '{id}'", f"GET {self.address} returns the existing ids")
        return jobs[0]

    def has(self, id: str) -> bool:
        """Whether there is a job with the id `id`."""
        return bool(self.client.list_workflows(workflow_ids=[id], name=self.workflow, load_output=False))

    def newest(self, limit: int, offset: int, wanted: JobFilter = _ALL) -> list[WorkflowStatus]:
        """Return the wanted jobs, newest first, without their outputs; those that failed with the cause."""
        ids = self.table.newest(self.workflow, wanted, limit, offset)
        if not ids:  # which would select all
            return []
        jobs = {job.workflow_id: job for job in self.client.list_workflows(workflow_ids=ids, load_output=False)}
        failed = [id for id, job in jobs.items() if STATUS[job.status] == "failed"]
        if failed:  # whose output is the error alone
            jobs |= {job.workflow_id: job for job in self.client.list_workflows(workflow_ids=failed)}
        return [jobs[id] for id in ids if id in jobs]

    def total(self, wanted: JobFilter = _ALL) -> int:
        """Return the number of wanted jobs."""
        return self.table.count(self.workflow, wanted)

    def active(self, most: int) -> list[WorkflowStatus]:
        """Return the running jobs and those that wait, in the order of submission; at most so many of each."""
        return [job for status in ("PENDING", "ENQUEUED")
                for job in self.client.list_workflows(name=self.workflow, status=status, limit=most, load_output=False)]

    def progress(self, id: str) -> dict[str, Any] | None:
        """Return the latest progress that the worker reported for the job, or None if it reported none."""
        progress: dict[str, Any] | None = self.client.get_event(id, PROGRESS, timeout_seconds=0)
        return progress

    def cancel(self, id: str) -> None:
        """Cancel the job unless it has ended; the worker ends its computation within a second."""
        if STATUS[self.find(id).status] in ACTIVE:  # the time at which a cancelled job ended would become the present
            self.client.cancel_workflow(id)

    def delete(self, id: str) -> None:
        """Delete the job with its progress and result."""
        self.client.delete_workflow(id)

    def ahead(self, job: WorkflowStatus) -> int | None:
        """Return the number of jobs before this one in its queue, or None if it is not queued."""
        if job.status != "ENQUEUED":
            return None
        return self.table.ahead(job.workflow_id, str(job.queue_name), int(job.created_at or 0))


def _has_nul(value: object) -> bool:
    """Whether a text in a JSON value has the character U+0000."""
    if isinstance(value, Mapping):
        return any(_has_nul(each) for entry in value.items() for each in entry)
    return "\0" in value if isinstance(value, str) else isinstance(value, list | tuple) and any(map(_has_nul, value))


def job_stores(client: DBOSClient, table: JobTable) -> Mapping[str, JobStore]:
    """Return the jobs of each kind."""
    return {kind: JobStore(client, table, kind, address) for kind, address in KINDS.items()}
