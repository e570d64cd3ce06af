"""`serve-jobs`: wait for the fits and studies that the service takes in, and run them one at a time."""

import argparse
import fcntl
import logging
import os
import signal
import sqlite3
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from dbos import DBOS, error
from sqlalchemy import Engine, event, make_url

from slipstick.errors import InvalidValue
from slipstick.storage.library import Library
from worker import fit_job, jobs, study_job

_APPLICATION = "slipstick"
_VERSION = "fits-2"
"""Of the steps of a job, not of the program: a job is taken up by any program whose steps are the same."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command line; tables and jobs must be those of the service."""
    parser.add_argument("--tables", type=Path, default=os.environ.get("SLIPSTICK_TABLES", "tables"), metavar="FOLDER",
                        help="folder of the tables and recordings (default: %(default)s, SLIPSTICK_TABLES)")
    parser.add_argument("--jobs", default=os.environ.get("SLIPSTICK_JOBS", "sqlite:///var/jobs.sqlite"), metavar="URL",
                        help="database that holds the jobs (default: %(default)s, SLIPSTICK_JOBS)")
    parser.add_argument("--name", default="worker-1",
                        help="this worker, which takes up what one of that name has left (default: %(default)s)")


def run(arguments: argparse.Namespace) -> int:
    """Run jobs until SIGTERM or SIGINT; raises `InvalidValue` where a worker of that name runs already."""
    stops = {signal.SIGTERM, signal.SIGINT}
    # Blocked before there are other threads: one of them may otherwise be given the signal, and this one sleeps on.
    signal.pthread_sigmask(signal.SIG_BLOCK, stops)
    with _sole(arguments.jobs, arguments.name):
        DBOS(config={"name": _APPLICATION, "system_database_url": arguments.jobs, "application_version": _VERSION,
                     "executor_id": arguments.name, "log_level": "WARNING"})
        logging.getLogger("dbos").addFilter(_is_no_cancellation)
        library = Library(arguments.tables)
        fit_job.register(library)
        study_job.register(library)
        DBOS.launch()
        DBOS.register_queue(jobs.QUEUE, worker_concurrency=1, polling_interval_sec=0.2)
        print(f"Worker {arguments.name} waits for fits and studies in {arguments.jobs}", flush=True)
        signal.sigwait(stops)
        print("Stopped; what has not ended goes on at the next start", flush=True)
        # Whatever runs may be cut off at any point, so there is nothing to wait for.
        os._exit(0)


def _is_no_cancellation(record: logging.LogRecord) -> bool:
    # DBOS logs a cancelled job as an error with a traceback; it is what somebody asked for.
    return not (record.exc_info and isinstance(record.exc_info[1], error.DBOSAwaitedWorkflowCancelledError))


@event.listens_for(Engine, "connect")
def _prepare_sqlite(connection: object, _: object) -> None:
    if isinstance(connection, sqlite3.Connection):
        # DBOS asks for the time with sub-second precision, which SQLite knows only from 3.42 on.
        connection.create_function("unixepoch", -1, lambda *_: time.time())
        connection.execute("PRAGMA busy_timeout=30000")
        connection.execute("PRAGMA journal_mode=WAL")


@contextmanager
def _sole(url: str, name: str) -> Iterator[None]:
    """Hold the lock on the name: of two workers with one name, each would restart the jobs of the other."""
    place = make_url(url)
    embedded = place.get_backend_name() == "sqlite" and place.database
    folder = Path(place.database or "").parent if embedded else Path(tempfile.gettempdir())
    folder.mkdir(parents=True, exist_ok=True)
    of = Path(place.database).stem if embedded and place.database else place.database or "memory"
    with (folder / f"{_APPLICATION}-{of}-{name}.lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # the kernel releases it however the process ends
        except BlockingIOError:
            raise InvalidValue(f"A worker named '{name}' is running already",
                               "Stop it, or give this one another --name") from None
        yield
