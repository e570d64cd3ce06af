"""`serve-jobs`: run the fits and studies submitted to the service, one short and one long job at a time."""

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
from multiprocessing import resource_tracker
from pathlib import Path

from dbos import DBOS, error
from sqlalchemy import Engine, event, make_url

from slipstick.errors import InvalidValue
from slipstick.machine import open_machine
from worker import fit_job, heartbeat, jobs, study_job
from worker.computing import Computer

_APPLICATION = "slipstick"
_VERSION = "jobs-4"
"""Version of the workflow steps, not of the program: a worker resumes only jobs with the same version of the steps."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command. Tables and jobs must be those of the service."""
    parser.add_argument("--tables", type=Path, default=os.environ.get("SLIPSTICK_TABLES", "tables"), metavar="FOLDER",
                        help="folder of the tables and recordings, the same as for the service "
                             "(default: %(default)s; environment variable SLIPSTICK_TABLES)")
    parser.add_argument("--jobs", default=os.environ.get("SLIPSTICK_JOBS", "sqlite:///var/jobs.sqlite"), metavar="URL",
                        help="URL of the job database, the same as for the service "
                             "(default: %(default)s; environment variable SLIPSTICK_JOBS)")
    parser.add_argument("--machine", type=Path, action="append", default=[], metavar="FILE.toml",
                        help="a machine whose simulator fits with `simulate` may run; repeat the option for each")
    parser.add_argument("--name", default="worker-1",
                        help="name of this worker; each worker needs its own. Jobs that a stopped worker left "
                             "unfinished are taken over by another, or resumed under the same name (default: "
                             "%(default)s)")


def run(arguments: argparse.Namespace) -> int:
    """Run jobs until SIGTERM or SIGINT; raises `InvalidValue` if a worker of the same name is running."""
    files = [open_machine(path) for path in arguments.machine]
    machines = {file.machine.digest: file for file in files}
    stops = {signal.SIGTERM, signal.SIGINT}
    resource_tracker.ensure_running()  # before the next lines: when it starts, it unblocks these signals
    # Blocked before other threads start: they inherit the mask, so that only `sigwait` below receives the signals.
    signal.pthread_sigmask(signal.SIG_BLOCK, stops)
    with _locked_name(arguments.jobs, arguments.name):
        DBOS(config={"name": _APPLICATION, "system_database_url": arguments.jobs, "application_version": _VERSION,
                     "executor_id": arguments.name, "log_level": "WARNING"})
        logging.getLogger("dbos").addFilter(_is_not_cancellation)
        modules = "worker.fit_steps", "worker.study_steps"
        computers = {queue: Computer(arguments.tables, modules) for queue in jobs.QUEUES}
        fit_job.register(computers, machines)
        study_job.register(computers)
        DBOS.launch()
        for queue in jobs.QUEUES:
            DBOS.register_queue(queue, worker_concurrency=1, polling_interval_sec=0.2)
        heartbeat.start(arguments.jobs, arguments.name)
        print(f"Worker {arguments.name} is waiting for fits and studies in {arguments.jobs}", flush=True)
        signal.sigwait(stops)
        heartbeat.stop(arguments.jobs, arguments.name)
        print("Stopped. Another worker takes over unfinished jobs, or they resume at the next start.", flush=True)
        # A running job can be interrupted at any point, so the worker does not wait for it.
        os._exit(0)


def _is_not_cancellation(record: logging.LogRecord) -> bool:
    # DBOS logs a cancelled job as an error with a traceback, although the user requested it.
    return not (record.exc_info and isinstance(record.exc_info[1], error.DBOSAwaitedWorkflowCancelledError))


@event.listens_for(Engine, "connect")
def _prepare_sqlite(connection: object, _: object) -> None:
    if isinstance(connection, sqlite3.Connection):
        # DBOS calls `unixepoch` with subsecond precision, which SQLite supports from version 3.42 on.
        connection.create_function("unixepoch", -1, lambda *_: time.time())
        connection.execute("PRAGMA busy_timeout=30000")
        connection.execute("PRAGMA journal_mode=WAL")


@contextmanager
def _locked_name(url: str, name: str) -> Iterator[None]:
    """Hold the lock on the name: two workers with the same name would restart each other's jobs."""
    address = make_url(url)
    is_file = address.get_backend_name() == "sqlite" and address.database
    folder = Path(address.database or "").parent if is_file else Path(tempfile.gettempdir())
    folder.mkdir(parents=True, exist_ok=True)
    database = Path(address.database).stem if is_file and address.database else address.database or "memory"
    with (folder / f"{_APPLICATION}-{database}-{name}.lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # the kernel releases the lock however the process ends
        except BlockingIOError:
            raise InvalidValue(f"A worker named '{name}' is already running",
                               "Stop it, or give this worker another --name") from None
        yield
