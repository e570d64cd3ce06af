"""`serve`: start the service as a program of its own, and a worker beside it if wanted."""

import argparse
import importlib.util
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from slipstick import interruption
from slipstick.errors import InvalidValue
from slipstick.storage.shipped import FOLDER

from .bench_option import library_folder
from .program import PACKAGE, SERVICE

_POLL_SECONDS = 0.1
_END_SECONDS = 10.0
"""Time that the programs have to end after a signal before they are killed."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command; what is not given is as docs/settings.md has it."""
    parser.add_argument("--port", type=int, metavar="N", help="port to listen on (SLIPSTICK_PORT; default: 8000)")
    parser.add_argument("--host", metavar="ADDRESS", help="address to listen on (SLIPSTICK_HOST; default: 127.0.0.1)")
    parser.add_argument("--tables", type=Path, default=library_folder(), metavar="FOLDER",
                        help="folder of benches, tables and recordings; where it has no bench, the shipped files "
                             "are put there (SLIPSTICK_TABLES; default: %(default)s)")
    parser.add_argument("--jobs", metavar="URL",
                        help="URL of the job database (SLIPSTICK_JOBS; default: sqlite:///var/jobs.sqlite)")
    parser.add_argument("--with-worker", action="store_true",
                        help="run a worker for the jobs beside it, and end both together")
    parser.add_argument("--machine", type=Path, action="append", default=[], metavar="FILE",
                        help="a machine that jobs of the worker may simulate or study, as with `work --machine`")
    parser.add_argument("--no-compile", action="store_true",
                        help="the worker does not compile what jobs run in the background, as with `work --no-compile`")


def run(arguments: argparse.Namespace) -> int:
    """Serve until SIGTERM, Ctrl-C, or the end of the service; without a worker this process becomes the service."""
    require_service()
    fill(arguments.tables)
    given = {"PORT": arguments.port, "HOST": arguments.host, "TABLES": arguments.tables, "JOBS": arguments.jobs}
    environment = {**os.environ, **{f"SLIPSTICK_{name}": str(value) for name, value in given.items()
                                    if value is not None}}
    given_to_worker = [*(["--no-compile"] if arguments.no_compile else []),
                       *(word for path in arguments.machine for word in ("--machine", str(path)))]
    service, worker = ([sys.executable, "-m", *words] for words in ([SERVICE], [PACKAGE, "work", *given_to_worker]))
    if not arguments.with_worker:
        if arguments.machine:
            raise InvalidValue("The service itself runs no file of a machine", "Give --with-worker as well")
        os.execve(sys.executable, service, environment)
    received = list[int]()
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # as with `nohup`, and `&` in a script
            signal.signal(number, lambda number, _: received.append(number))
    # In sessions of their own, Ctrl-C reaches them through this process only, and each says once that it ends.
    programs = [subprocess.Popen(command, env=environment, start_new_session=True) for command in (service, worker)]
    try:
        while not received and all(program.poll() is None for program in programs):
            time.sleep(_POLL_SECONDS)
        status = next((program.returncode for program in programs if program.returncode), 0)
        for name, program in zip(("service", "worker"), programs, strict=True):
            if program.returncode and program.returncode < 0 and not received:
                print(f"The {name} was ended by {signal.Signals(-program.returncode).name}, and the other program ends "
                      "with it. Start the same command again: jobs that were running are resumed", file=sys.stderr)
    finally:
        end(programs)
    if signal.SIGINT in received:
        return interruption.STATUS
    return status if status >= 0 else 128 - status  # as shells have it for a program that a signal has killed


def end(programs: list[subprocess.Popen[bytes]]) -> None:
    """End the programs, and kill those that do not end."""
    for program in programs:
        if program.poll() is None:
            program.terminate()
    for program in programs:
        try:
            program.wait(_END_SECONDS)
        except subprocess.TimeoutExpired:
            program.kill()
            program.wait()


def require_service() -> None:
    """Raise `ModuleNotFoundError` where the extra of the service is not installed, before anything is made for it."""
    for library in ("fastapi", "dbos"):
        if importlib.util.find_spec(library) is None:
            raise ModuleNotFoundError(name=library)


def fill(folder: Path) -> None:
    """Put what is shipped into the folder of tables, which is made, where it has no bench."""
    if any(folder.glob("*.toml")):
        return
    folder.mkdir(parents=True, exist_ok=True)
    names = [name for name in ("heavy.toml", "compact.toml", "sample.h5") if not (folder / name).exists()]
    for name in names:
        shutil.copy(FOLDER / name, folder)
    print(f"Put {', '.join(names)} into the folder {folder}", file=sys.stderr)
