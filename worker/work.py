"""`work`: run the jobs submitted to the service, one short, one long and one of each machine at a time."""

import argparse
import logging
import os
import signal
import socket
import subprocess
import sys
from collections import defaultdict
from multiprocessing import resource_tracker
from pathlib import Path

from slipstick import interruption
from slipstick.black_box import BlackBox
from slipstick.black_box.declared import open_once
from slipstick.black_box.known import list_known
from slipstick.errors import InvalidValue, SlipstickError
from slipstick.storage import shipped

from .bench_option import library_folder
from .computing import Computer, forking_of
from .executors import add_dask_argument
from .simulators import Simulators

_APPLICATION = "slipstick"
_VERSION = "jobs-4"
"""Version of the workflow steps, not of the program: a worker resumes only jobs with the same version of the steps."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command. Tables and jobs must be those of the service."""
    parser.add_argument("--tables", type=Path, default=library_folder(), metavar="FOLDER",
                        help="folder of the tables and recordings, the same as for the service "
                             "(default: %(default)s; environment variable SLIPSTICK_TABLES)")
    # The help text does not show the value of the variable, which may contain a password.
    parser.add_argument("--jobs", default=os.environ.get("SLIPSTICK_JOBS", "sqlite:///var/jobs.sqlite"), metavar="URL",
                        help="URL of the job database, the same as for the service (default: environment variable "
                             "SLIPSTICK_JOBS, or sqlite:///var/jobs.sqlite)")
    parser.add_argument("--machine", type=Path, action="append", default=[], metavar="FILE",
                        help="a machine that jobs may simulate: fits with `simulate`, builds of tables, and studies "
                             "and calibrations of its runs; repeat the option for each")
    add_dask_argument(parser)
    parser.add_argument("--no-compile", action="store_true",
                        help="do not compile what jobs run in the background at the start, one or two minutes of one "
                             "core at the lowest priority, once for this installation; the first jobs then do so")
    parser.add_argument("--name",
                        help="name of this worker; each worker needs its own. Jobs that a stopped worker left "
                             "unfinished are taken over by another, or resumed under the same name (default: "
                             "worker-1; with PostgreSQL the name of the machine)")


def run(arguments: argparse.Namespace) -> int:
    """Run jobs until SIGTERM or SIGINT.

    Raises `InvalidValue` if a worker of the same name is running, or without a folder of tables, in which all jobs
    would fail.
    """
    from dbos import DBOS  # an extra, which --help needs not

    from slipstick.storage.database import file_of, is_server, open_database, shown
    from slipstick.storage.queues import QUEUES, name_machine_queue

    from . import build_job, calibration_job, fit_job, heartbeat, known_machines, study_job
    from .worker_name import locked_name

    if not Path(arguments.tables).is_dir():
        raise InvalidValue(f"There is no folder '{arguments.tables}'",
                           "Give that of the service as --tables, or in SLIPSTICK_TABLES")
    paths = [shipped.file_of(path, ".py", "machines").resolve() for path in arguments.machine]
    files = [file for path in paths for file in BlackBox.open_all(path)]
    simulators = Simulators({file.description.digest: file for file in files}, arguments.dask)
    declared = {open_once(path).name: str(path) for path in paths if path.suffix == ".py"}
    known = list_known([open_once(Path(path)) for path in declared.values()], files)
    stops = {signal.SIGTERM, signal.SIGINT}
    resource_tracker.ensure_running()  # before the next lines: when it starts, it unblocks these signals
    # Blocked before other threads start: they inherit the mask, so that only `sigwait` below receives the signals.
    signal.pthread_sigmask(signal.SIG_BLOCK, stops)
    engine, file = open_database(arguments.jobs), file_of(arguments.jobs)
    name = arguments.name or (socket.gethostname() if is_server(arguments.jobs) else "worker-1")
    with locked_name(name, engine, file) as has_name:
        DBOS(config={"name": _APPLICATION, "system_database_url": arguments.jobs, "application_version": _VERSION,
                     "executor_id": name, "log_level": "WARNING"})
        logging.getLogger("dbos").addFilter(is_unexpected)
        rehearse = [sys.executable, "-m", f"{__package__}.rehearsal"]
        rehearsal = None if arguments.no_compile else subprocess.Popen(rehearse)
        modules = tuple(f"{__package__}.{kind}_steps" for kind in ("fit", "study", "calibration", "build"))
        forking = forking_of(modules)
        queues = *QUEUES, *(name_machine_queue(each.name) for each in known)
        computers = defaultdict[str, Computer](lambda: Computer(arguments.tables, forking))
        for queue in QUEUES:  # those of machines start with their first job
            _ = computers[queue]
        fit_job.register(computers, simulators)
        study_job.register(computers, declared, arguments.dask)
        calibration_job.register(computers, declared, arguments.dask)
        build_job.register(computers, simulators)
        DBOS.listen_queues(queues)
        DBOS.launch()
        for queue in queues:
            DBOS.register_queue(queue, worker_concurrency=1, polling_interval_sec=0.2)
        heartbeat.start(engine, name, has_name)
        known_machines.tell(engine, name, known)
        print(f"Worker {name} is waiting for jobs in {shown(arguments.jobs)}", flush=True)
        received = signal.sigwait(stops)
        if rehearsal is not None:
            rehearsal.kill()
        heartbeat.stop(engine, name)
        print("Stopped. Another worker takes over unfinished jobs, or they resume at the next start.", file=sys.stderr,
              flush=True)
        # A running job can be interrupted at any point, so the worker does not wait for it.
        os._exit(interruption.STATUS if received == signal.SIGINT else 0)


def is_unexpected(record: logging.LogRecord) -> bool:
    """Whether a record of DBOS is not only that a job was cancelled, or failed for a cause that the job tells.

    DBOS logs both as errors with a traceback.
    """
    from dbos import error

    expected = error.DBOSAwaitedWorkflowCancelledError, SlipstickError
    return not (record.exc_info and isinstance(record.exc_info[1], expected))
