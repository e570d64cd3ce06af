"""Workers that watch each other: each one writes the time every second, and takes over the jobs of one that stopped.

The table is shared with the service (service/heartbeats.py), which counts the workers that are alive.
"""

import logging
import threading
import time

from dbos import DBOS
from sqlalchemy import Engine, create_engine, text
from sqlalchemy.exc import SQLAlchemyError

from worker.jobs import QUEUES

_SECONDS = 1.0
_DEAD_SECONDS = 5.0
"""A worker without heartbeat for this time is dead; the service counts in the same way."""
_CREATE = "CREATE TABLE IF NOT EXISTS slipstick_workers (name VARCHAR(255) PRIMARY KEY, seen DOUBLE PRECISION NOT NULL)"
_BEAT = """INSERT INTO slipstick_workers (name, seen) VALUES (:name, :seen)
ON CONFLICT (name) DO UPDATE SET seen = excluded.seen"""
_LOG = logging.getLogger("dbos")


def start(url: str, name: str) -> None:
    """Write the heartbeat of the worker `name` from now on, and take over jobs of dead workers."""
    engine = create_engine(url)
    with engine.begin() as connection:
        connection.execute(text(_CREATE))
    beat(engine, name)
    threading.Thread(target=_beat_for_ever, args=(engine, name), daemon=True).start()


def beat(engine: Engine, name: str) -> list[str]:
    """Write the heartbeat, return the jobs of dead workers to the queue, and return the ids of these jobs."""
    now = time.time()
    dead = {"before": now - _DEAD_SECONDS}
    with engine.begin() as connection:
        connection.execute(text(_BEAT), {"name": name, "seen": now})
        names = connection.execute(text("SELECT name FROM slipstick_workers WHERE seen < :before"),
                                   dead).scalars().all()
    left = DBOS.list_workflows(executor_id=list(names), status="PENDING", load_input=False,
                               load_output=False) if names else []
    for queue in QUEUES:
        if waiting := [job.workflow_id for job in left if (job.queue_name or QUEUES[0]) == queue]:
            DBOS.resume_workflows(waiting, queue_name=queue)
    ids = [job.workflow_id for job in left]
    if ids:
        print(f"Took over {', '.join(ids)} from {', '.join(names)}", flush=True)
    with engine.begin() as connection:  # last: a worker killed before this line leaves the jobs to the next one
        for one in names:
            connection.execute(text("DELETE FROM slipstick_workers WHERE name = :name AND seen < :before"),
                               {"name": one, **dead})
    return ids


def stop(url: str, name: str) -> None:
    """Remove the heartbeat of a worker that stops, so that others take over its jobs at once."""
    with create_engine(url).begin() as connection:
        connection.execute(text("UPDATE slipstick_workers SET seen = 0 WHERE name = :name"), {"name": name})


def _beat_for_ever(engine: Engine, name: str) -> None:
    while True:
        time.sleep(_SECONDS)
        try:
            beat(engine, name)
        except SQLAlchemyError as error:  # such as a database that restarts: the next heartbeat may succeed
            _LOG.warning("The heartbeat was not written: %s", error)
