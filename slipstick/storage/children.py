"""Child processes that start within hundredths of a second: forks of one process that has imported the program.

A new interpreter takes seconds of processor time for its imports. The process that forks has a single thread and no
data, so that a fork is safe there, as it is not in a service with threads. It starts at the first call and ends with
this process. A fork computes one function, with limits if the content is not trusted, and ends.
"""

import atexit
import importlib
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import traceback
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from slipstick.errors import SlipstickError

_ROOT = Path(__file__).parents[2]
_IMPORTED = ("slipstick.table.upload", "slipstick.recordings.hdf5_form", "slipstick.acquisition.archive",
             "slipstick.report.made")
"""What is called; a function of another module works as well, after its import in each fork."""


@dataclass(frozen=True)
class Limits:
    """Processor time in s and address space in bytes of a child process; it may take six times `seconds` in all."""

    seconds: int
    memory: int


class ChildFailed(Exception):
    """The child process crashed, exceeded its limits, or raised the error whose traceback this is."""


def call(function: str, content: bytes, error: type[SlipstickError], limits: Limits | None = None) -> bytes:
    """Bytes that `function`, "module:function", returns for `content` in a child process; empty if it returns others.

    Raises `error`, with the cause and remedy of the `SlipstickError` that the function raises, and `ChildFailed`.
    """
    asked = json.dumps({"function": function, "limits": limits and [limits.seconds, limits.memory]}).encode() + b"\n"
    with _FORKING.connect() as connection, suppress(OSError):  # of a child that ends before it has read everything
        connection.sendall(asked)
        connection.sendall(content)
        connection.shutdown(socket.SHUT_WR)
        with connection.makefile("rb") as answer:
            if said := answer.readline():
                refused, failed = json.loads(said)
                if refused:
                    raise error(*refused)
                if failed:
                    raise ChildFailed(failed)
                return answer.read()
    raise ChildFailed(f"The process of {function} ended without an answer")


class _Forking:
    """The process that forks, started when it is needed and again if it was killed."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._control: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None

    def connect(self) -> socket.socket:
        """A connection to a new fork."""
        ours, theirs = socket.socketpair()
        with theirs, self._lock:
            try:
                self._send(theirs)
            except OSError:
                self._start()
                self._send(theirs)
        return ours

    def _send(self, connection: socket.socket) -> None:
        if self._control is None:
            raise OSError
        socket.send_fds(self._control, [b"f"], [connection.fileno()])

    def _start(self) -> None:
        self._control, theirs = socket.socketpair()
        with theirs:
            command = f"from slipstick.storage.children import serve; serve({theirs.fileno()})"
            # Threads of a library would not survive the forks.
            self._process = subprocess.Popen([sys.executable, "-c", command], pass_fds=[theirs.fileno()], cwd=_ROOT,
                                             stdin=subprocess.DEVNULL, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})

    def end(self) -> None:
        """End the process that forks, if there is one; forks finish what they compute."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()


_FORKING = _Forking()
atexit.register(_FORKING.end)


def serve(descriptor: int) -> None:
    """In the process that forks: answer connections that arrive over the socket `descriptor` until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that this one ends with
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for the forks
    for module in _IMPORTED:
        importlib.import_module(module)
    with socket.socket(fileno=descriptor) as control:
        while True:
            _, (*descriptors,), _, _ = socket.recv_fds(control, 1, 1)
            if not descriptors:
                return
            with socket.socket(fileno=descriptors[0]) as connection:
                if os.fork() == 0:
                    _become_child(control, connection)


def _become_child(control: socket.socket, connection: socket.socket) -> None:
    try:
        control.close()
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # a child may have children of its own
        os.nice(5)  # what waits for the child has other requests to answer
        silence = os.open(os.devnull, os.O_WRONLY)
        for stream in (1, 2):  # libraries write what they think of a damaged file
            os.dup2(silence, stream)
        with connection.makefile("rwb") as file:
            asked = json.loads(file.readline())
            if asked["limits"]:
                _limit(*asked["limits"])
            refused, failed, result = _computed(asked["function"], file.read())
            file.write(json.dumps([refused, failed]).encode() + b"\n")
            file.write(result)
    finally:
        os._exit(0)


def _limit(seconds: int, memory: int) -> None:
    signal.alarm(6 * seconds)
    with suppress(ValueError, OSError):  # not every system limits the address space
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))


def _computed(function: str, content: bytes) -> tuple[tuple[str, str] | None, str | None, bytes]:
    """Cause and remedy of a `SlipstickError`, the traceback of another error, and the result."""
    module, _, name = function.partition(":")
    try:
        result = getattr(importlib.import_module(module), name)(content)
    except SlipstickError as error:
        return (error.cause, error.remedy), None, b""
    except Exception:
        return None, traceback.format_exc(), b""
    return None, None, result if isinstance(result, bytes) else b""
