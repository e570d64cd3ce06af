"""The service's access to the job database: submit jobs, and read their progress and results.

The worker runs the jobs (worker/jobs.py). Service and worker share no code. They agree on the names below, on the
workflow names `fit` and `study`, and on the input of each workflow: a JSON object with `recordings`,
`recordings_digest` and `settings`, to which a fit adds `table`, `table_digest`, `simulate`, `parameters` and `outside`.
"""

from dataclasses import dataclass
from typing import Any, Literal

from dbos import DBOS, DBOSClient, WorkflowStatus, error

from service.job_filter import ACTIVE, JobFilter
from service.problem_details import Conflict
from slipstick.errors import UnknownName
from slipstick.storage.database import open_database

PROGRESS = "progress"
Queue = Literal["short", "long"]
"""A worker runs one job of each queue at a time, so that a short job does not wait for a long one."""
APPLICATION = "slipstick"

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
    workflow: str
    address: str

    def submit(self, id: str, job_input: JobInput, queue: Queue) -> WorkflowStatus:
        """Enqueue a job with the id `id`; if a job of this kind already has the id, return that job instead.

        Raises `Conflict` if a job of another kind has the id.
        """
        try:
            self.client.enqueue({"workflow_name": self.workflow, "queue_name": queue, "workflow_id": id,
                                 "serialization_type": "portable"}, job_input)  # type: ignore[typeddict-item]
        except error.DBOSConflictingWorkflowError:
            raise Conflict(f"The Idempotency-Key '{id}' is in use for a job that is not a {self.workflow}",
                           "Use a different Idempotency-Key") from None
        return self.find(id)

    def find(self, id: str) -> WorkflowStatus:
        """Return the job with the id `id`; raises `UnknownName`."""
        jobs = self.client.list_workflows(workflow_ids=[id], name=self.workflow)
        if not jobs:
            raise UnknownName(f"There is no {self.workflow} '{id}'", f"GET {self.address} returns the existing ids")
        return jobs[0]

    def newest(self, limit: int, offset: int, wanted: JobFilter = _ALL) -> list[WorkflowStatus]:
        """Return the wanted jobs, newest first, without their outputs."""
        if wanted.reads_inputs:
            return self._selected(wanted)[offset:offset + limit]
        return self.client.list_workflows(name=self.workflow, sort_desc=True, limit=limit, offset=offset,
                                          load_output=False, **wanted.query)

    def total(self, wanted: JobFilter = _ALL) -> int:
        """Return the number of wanted jobs."""
        if wanted.reads_inputs:
            return len(self._selected(wanted))
        return len(self.client.list_workflows(name=self.workflow, load_input=False, load_output=False, **wanted.query))

    def active(self) -> list[WorkflowStatus]:
        """Return the queued and running jobs in the order of submission."""
        return self.client.list_workflows(name=self.workflow, load_output=False, **JobFilter(status=ACTIVE).query)

    def _selected(self, wanted: JobFilter) -> list[WorkflowStatus]:
        jobs = self.client.list_workflows(name=self.workflow, sort_desc=True, load_output=False, **wanted.query)
        return [job for job in jobs if job.input is not None and wanted.selects(job.input["args"][0])]

    def progress(self, id: str) -> dict[str, Any] | None:
        """Return the latest progress that the worker reported for the job, or None if it reported none."""
        progress: dict[str, Any] | None = self.client.get_event(id, PROGRESS, timeout_seconds=0)
        return progress

    def cancel(self, id: str) -> None:
        """Cancel the job unless it has ended; the worker ends its computation within a second."""
        self.client.cancel_workflow(self.find(id).workflow_id)

    def delete(self, id: str) -> None:
        """Delete the job with its progress and result."""
        self.client.delete_workflow(id)

    def ahead(self, job: WorkflowStatus) -> int | None:
        """Return the number of jobs before this one in its queue, or None if it is not queued."""
        if job.status != "ENQUEUED":
            return None
        queued = self.client.list_workflows(queue_name=job.queue_name, status="ENQUEUED", load_input=False,
                                            load_output=False)
        ids = [entry.workflow_id for entry in queued]  # in the order of submission
        return ids.index(job.workflow_id) if job.workflow_id in ids else None

    def ids_using(self, key: str, name: str) -> list[str]:
        """Return the ids of the queued and running jobs whose input `key` (`table`, `recordings`) is `name`."""
        return [job.workflow_id for job in self.active()
                if job.input is not None and job.input["args"][0].get(key) == name]

    def states(self) -> list[tuple[str, str | None]]:
        """Return state and queue of every job, as the database has them."""
        jobs = self.client.list_workflows(name=self.workflow, load_input=False, load_output=False)
        return [(job.status, job.queue_name) for job in jobs]

    def counts(self) -> tuple[int, int]:
        """Return the numbers of queued and of running jobs."""
        states = [job.status for job in self.client.list_workflows(
            name=self.workflow, status=["ENQUEUED", "PENDING"], load_input=False, load_output=False)]
        return states.count("ENQUEUED"), states.count("PENDING")
