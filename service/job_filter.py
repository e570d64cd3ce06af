"""Statuses of jobs, and which jobs a list contains."""

import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

Status = Literal["queued", "running", "done", "failed", "cancelled"]
STATUS: dict[str, Status] = {
    "DELAYED": "queued", "ENQUEUED": "queued", "PENDING": "running", "SUCCESS": "done", "ERROR": "failed",
    "MAX_RECOVERY_ATTEMPTS_EXCEEDED": "failed", "CANCELLED": "cancelled"}
"""Our status for each one of the job database."""
ENDED: tuple[Status, ...] = ("done", "failed", "cancelled")
ACTIVE: tuple[Status, ...] = ("queued", "running")


@dataclass(frozen=True)
class JobFilter:
    """The jobs with one of `status`, submitted at or after `since`, of these recordings and this table; all by default.
    """

    status: Sequence[Status] | None = None
    since: datetime.datetime | None = None
    recordings: str | None = None
    table: str | None = None

    @property
    def query(self) -> dict[str, Any]:
        """What of it the job database can select."""
        states = None if self.status is None else [state for state, status in STATUS.items() if status in self.status]
        return {"status": states, "start_time": None if self.since is None else self.since.isoformat()}

    @property
    def reads_inputs(self) -> bool:
        """Whether the inputs of jobs decide."""
        return self.recordings is not None or self.table is not None

    def selects(self, job_input: dict[str, Any]) -> bool:
        """Whether a job with this input is of these recordings and this table."""
        return self.recordings in (None, job_input["recordings"]) and self.table in (None, job_input.get("table"))
