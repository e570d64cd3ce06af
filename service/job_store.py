"""The side of the job store that the service sees: jobs go in, their progress and results come out.

The worker runs them (worker/jobs.py). The two share no code: they agree on the names below, on those of the workflows
`fit` and `study`, and on the order of each, a JSON object with `recordings`, `recordings_digest` and `settings`; that
of a fit also has `table`, `table_digest`, `simulate`, `parameters` and `outside`.
"""

import sqlite3
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dbos import DBOS, DBOSClient, WorkflowStatus, error
from sqlalchemy import Engine, event, make_url

from service.problem_details import Conflict
from slipstick.errors import UnknownName

QUEUE, PROGRESS = "jobs", "progress"
APPLICATION = "slipstick"

Order = dict[str, Any]


@event.listens_for(Engine, "connect")
def _prepare_sqlite(connection: object, _: object) -> None:
    if isinstance(connection, sqlite3.Connection):
        # DBOS asks for the time with sub-second precision, which SQLite knows only from 3.42 on.
        connection.create_function("unixepoch", -1, lambda *_: time.time())
        connection.execute("PRAGMA busy_timeout=30000")
        connection.execute("PRAGMA journal_mode=WAL")


def connect(url: str) -> DBOSClient:
    """Open the database at `url`, which is created where it does not exist; `destroy()` gives it back."""
    place = make_url(url)
    if place.get_backend_name() == "sqlite" and place.database:
        Path(place.database).parent.mkdir(parents=True, exist_ok=True)
    DBOS.migrate(url)
    return DBOSClient(system_database_url=url, application_name=APPLICATION, retry_connection_errors=False)


@dataclass(frozen=True)
class JobStore:
    """The jobs of one kind: `workflow` is their name in the database, `address` where the service lists them."""

    client: DBOSClient
    workflow: str
    address: str

    def submit(self, id: str, order: Order) -> WorkflowStatus:
        """Put a job in the queue under the id `id`; where a job of this kind has the id, return that one instead.

        Raises `Conflict` where a job of another kind has it.
        """
        try:
            self.client.enqueue({"workflow_name": self.workflow, "queue_name": QUEUE, "workflow_id": id,
                                 "serialization_type": "portable"}, order)  # type: ignore[typeddict-item]
        except error.DBOSConflictingWorkflowError:
            raise Conflict(f"The key '{id}' belongs to something else than a {self.workflow}",
                           "Take another Idempotency-Key") from None
        return self.find(id)

    def find(self, id: str) -> WorkflowStatus:
        """The job with the id `id`; raises `UnknownName`."""
        found = self.client.list_workflows(workflow_ids=[id], name=self.workflow)
        if not found:
            raise UnknownName(f"There is no {self.workflow} '{id}'", f"GET {self.address} lists those there are")
        return found[0]

    def newest(self, limit: int, offset: int) -> list[WorkflowStatus]:
        """The jobs, the newest first, without their results."""
        return self.client.list_workflows(name=self.workflow, sort_desc=True, limit=limit, offset=offset,
                                          load_output=False)

    def progress(self, id: str) -> dict[str, Any] | None:
        """What the worker last said about the job, if anything."""
        said: dict[str, Any] | None = self.client.get_event(id, PROGRESS, timeout_seconds=0)
        return said

    def cancel(self, id: str) -> None:
        """Stop the job, unless it has ended; the worker leaves it at the end of its present step or before."""
        self.client.cancel_workflow(self.find(id).workflow_id)

    def counts(self) -> tuple[int, int]:
        """How many jobs wait, and how many run."""
        states = [job.status for job in self.client.list_workflows(
            name=self.workflow, status=["ENQUEUED", "PENDING"], load_input=False, load_output=False)]
        return states.count("ENQUEUED"), states.count("PENDING")
