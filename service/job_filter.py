"""Statuses of jobs, and which jobs a list contains."""

import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Status = Literal["queued", "running", "done", "failed", "cancelled"]
STATUS: dict[str, Status] = {
    "DELAYED": "queued", "ENQUEUED": "queued", "PENDING": "running", "SUCCESS": "done", "ERROR": "failed",
    "MAX_RECOVERY_ATTEMPTS_EXCEEDED": "failed", "CANCELLED": "cancelled"}
"""Our status for each one of the job database."""
ENDED: tuple[Status, ...] = ("done", "failed", "cancelled")
ACTIVE: tuple[Status, ...] = ("queued", "running")


@dataclass(frozen=True)
class JobFilter:
    """The jobs with one of `status`, submitted at or after `since`, of these files; all by default.

    `text` is contained in the id of the job or in the name of one of its files.
    """

    status: Sequence[Status] | None = None
    since: datetime.datetime | None = None
    recordings: str | None = None
    table: str | None = None
    bench: str | None = None
    name: str | None = None
    """That of the table that a job builds."""
    text: str | None = None

    @property
    def states(self) -> list[str] | None:
        """The states in the job database of these statuses; None for all."""
        return None if self.status is None else [state for state, status in STATUS.items() if status in self.status]

    @property
    def inputs(self) -> dict[str, str]:
        """What the inputs of jobs have to contain, by name."""
        given = {"recordings": self.recordings, "table": self.table, "bench": self.bench, "name": self.name}
        return {name: value for name, value in given.items() if value is not None}
