"""Workers that watch each other: each one writes the time every second, and takes over the jobs of one that stopped.

The table is shared with the service (service/heartbeats.py), which counts the workers that are alive. All times are
those of the database.
"""

import logging
import os
import threading
import time
from collections.abc import Callable

from dbos import DBOS
from sqlalchemy import Engine, text
from sqlalchemy.exc import SQLAlchemyError

from slipstick.storage.database import clock, create_tables
from slipstick.storage.queues import QUEUES

_SECONDS = 1.0
_DEAD_SECONDS = 5.0
"""A worker without heartbeat for this time is dead; the service counts in the same way."""
_CREATE = "CREATE TABLE IF NOT EXISTS slipstick_workers (name VARCHAR(255) PRIMARY KEY, seen DOUBLE PRECISION NOT NULL)"
_BEAT = """INSERT INTO slipstick_workers (name, seen) VALUES (:name, {now})
ON CONFLICT (name) DO UPDATE SET seen = excluded.seen"""
_LOG = logging.getLogger("dbos")


def start(engine: Engine, name: str, has_name: Callable[[], bool]) -> None:
    """Write the heartbeat of the worker `name` from now on, and take over jobs of dead workers.

    The process ends if it no longer `has_name`, which another worker then has locked.
    """
    create_tables(engine, _CREATE)
    beat(engine, name)
    threading.Thread(target=_beat_for_ever, args=(engine, name, has_name), daemon=True).start()


def beat(engine: Engine, name: str) -> None:
    """Write the heartbeat."""
    with engine.begin() as connection:
        connection.execute(text(_BEAT.format(now=clock(engine))), {"name": name})


def take_over(engine: Engine) -> list[str]:
    """Return the jobs of dead workers to the queue, and return the ids of these jobs."""
    is_dead = f"seen < {clock(engine)} - {_DEAD_SECONDS}"
    with engine.connect() as connection:
        names = connection.execute(text(f"SELECT name FROM slipstick_workers WHERE {is_dead}")).scalars().all()
    left = DBOS.list_workflows(executor_id=list(names), status="PENDING", load_input=False,
                               load_output=False) if names else []
    for queue in {job.queue_name or QUEUES[0] for job in left}:
        DBOS.resume_workflows([job.workflow_id for job in left if (job.queue_name or QUEUES[0]) == queue],
                              queue_name=queue)
    ids = [job.workflow_id for job in left]
    if ids:
        print(f"Took over {', '.join(ids)} from {', '.join(names)}", flush=True)
    with engine.begin() as connection:  # last: a worker killed before this line leaves the jobs to the next one
        for dead in names:
            connection.execute(text(f"DELETE FROM slipstick_workers WHERE name = :name AND {is_dead}"), {"name": dead})
    return ids


def stop(engine: Engine, name: str) -> None:
    """Remove the heartbeat of a worker that stops, so that others take over its jobs at once."""
    with engine.begin() as connection:
        connection.execute(text("UPDATE slipstick_workers SET seen = 0 WHERE name = :name"), {"name": name})


def _beat_for_ever(engine: Engine, name: str, has_name: Callable[[], bool]) -> None:
    last, patient_until = time.monotonic(), 0.0
    while True:
        time.sleep(_SECONDS)
        try:
            if not has_name():
                print(f"Another worker named '{name}' has started, so this one stops", flush=True)
                os._exit(1)
            beat(engine, name)
            # After a gap, as when the database restarts, the others have not been able to write theirs either.
            if time.monotonic() > last + _DEAD_SECONDS / 2:
                patient_until = time.monotonic() + _DEAD_SECONDS
            last = time.monotonic()
            if last > patient_until:
                take_over(engine)
        except SQLAlchemyError as error:  # such as a database that restarts: the next heartbeat may succeed
            _LOG.warning("The heartbeat was not written: %s", str(error).splitlines()[0])
