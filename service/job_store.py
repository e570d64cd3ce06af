"""The side of the job store that the service sees: fits go in, their progress and results come out.

The worker runs them (worker/jobs.py). The two share no code: they agree on the names below and on the order, a JSON
object with `table`, `table_digest`, `simulate`, `parameters`, `recordings`, `recordings_digest`, `outside`, `settings`.
"""

import sqlite3
import time
from pathlib import Path
from typing import Any

from dbos import DBOS, DBOSClient, WorkflowStatus
from sqlalchemy import Engine, event, make_url

from slipstick.errors import UnknownName

QUEUE, WORKFLOW, PROGRESS = "fits", "fit", "progress"
APPLICATION = "slipstick"

Order = dict[str, Any]


@event.listens_for(Engine, "connect")
def _prepare_sqlite(connection: object, _: object) -> None:
    if isinstance(connection, sqlite3.Connection):
        # DBOS asks for the time with sub-second precision, which SQLite knows only from 3.42 on.
        connection.create_function("unixepoch", -1, lambda *_: time.time())
        connection.execute("PRAGMA busy_timeout=30000")
        connection.execute("PRAGMA journal_mode=WAL")


class JobStore:
    """A connection to the database at `url`, which is created where it does not exist."""

    def __init__(self, url: str) -> None:
        place = make_url(url)
        if place.get_backend_name() == "sqlite" and place.database:
            Path(place.database).parent.mkdir(parents=True, exist_ok=True)
        DBOS.migrate(url)
        self._client = DBOSClient(system_database_url=url, application_name=APPLICATION, retry_connection_errors=False)

    def close(self) -> None:
        """Give the connections back."""
        self._client.destroy()

    def submit(self, fit: str, order: Order) -> WorkflowStatus:
        """Put a fit in the queue under the id `fit`; where the id is taken, return the fit that has it instead."""
        self._client.enqueue({"workflow_name": WORKFLOW, "queue_name": QUEUE, "workflow_id": fit,
                              "serialization_type": "portable"}, order)  # type: ignore[typeddict-item]
        return self.find(fit)

    def find(self, fit: str) -> WorkflowStatus:
        """The fit with the id `fit`; raises `UnknownName`."""
        found = self._client.list_workflows(workflow_ids=[fit], name=WORKFLOW)
        if not found:
            raise UnknownName(f"There is no fit '{fit}'", "GET /v1/fits lists those there are")
        return found[0]

    def newest(self, limit: int, offset: int) -> list[WorkflowStatus]:
        """The fits, the newest first, without their results."""
        return self._client.list_workflows(name=WORKFLOW, sort_desc=True, limit=limit, offset=offset, load_output=False)

    def progress(self, fit: str) -> dict[str, Any] | None:
        """What the worker last said about the fit, if anything."""
        said: dict[str, Any] | None = self._client.get_event(fit, PROGRESS, timeout_seconds=0)
        return said

    def cancel(self, fit: str) -> None:
        """Stop the fit, unless it has ended; the worker leaves it at the end of its present block."""
        self._client.cancel_workflow(self.find(fit).workflow_id)

    def counts(self) -> tuple[int, int]:
        """How many fits wait, and how many run."""
        states = [fit.status for fit in self._client.list_workflows(
            name=WORKFLOW, status=["ENQUEUED", "PENDING"], load_input=False, load_output=False)]
        return states.count("ENQUEUED"), states.count("PENDING")
