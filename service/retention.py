"""Removal of old jobs with their results: those that ended long ago, and those beyond a number."""

import asyncio
import logging
import time

from dbos import DBOSClient
from sqlalchemy.exc import SQLAlchemyError

from .job_filter import ENDED, JobFilter
from .job_store import KINDS
from .settings import Settings

_LOG = logging.getLogger("uvicorn.error")
_INTERVAL = 600.0  # s
_DAY = 86_400_000  # ms


async def remove_for_ever(client: DBOSClient, settings: Settings) -> None:
    """Remove old jobs now and every ten minutes."""
    while True:
        try:
            await asyncio.to_thread(remove_old, client, settings.kept_days, settings.kept_jobs, time.time())
        except SQLAlchemyError as error:
            _LOG.warning("Old jobs were not removed: %s", error)
        await asyncio.sleep(_INTERVAL)


def remove_old(client: DBOSClient, days: float, count: int, now: float) -> list[str]:
    """Delete the jobs that ended more than `days` before `now`, and all ended ones but the newest `count`.

    Returns their ids. Queued and running jobs stay.
    """
    ended = client.list_workflows(name=list(KINDS), status=JobFilter(status=ENDED).states, sort_desc=True,
                                  load_input=False, load_output=False)
    ids = [job.workflow_id for number, job in enumerate(ended)
           if number >= count or (job.completed_at or job.updated_at or 0) < now * 1000 - days * _DAY]
    if ids:
        client.delete_workflows(ids)
        _LOG.info("Removed %d old jobs: %s", len(ids), ", ".join(ids[:20]))
    return ids
