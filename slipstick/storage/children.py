"""Child processes that start within hundredths of a second: forks of one process that has imported the program.

A new interpreter takes seconds of processor time for its imports. The process that forks has a single thread and no
data, so that a fork is safe there, as it is not in a service with threads. It starts at the first call and ends with
this process, however this one ends. A fork of `call` computes one function, with limits if the content is not trusted,
and ends. That of a `Kept` stays for further calls, with what libraries keep in memory, and is for trusted content only.
Another module may have a `Forking` of its own, whose forks do something else.
"""

import atexit
import gc
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
from typing import Any

from slipstick.errors import SlipstickError
from slipstick.interruption import unheard

_ROOT = Path(__file__).parents[2]
_PREPARED = ("slipstick.table.upload", "slipstick.recordings.hdf5_form", "slipstick.acquisition.archive",
             "slipstick.report.made", "slipstick.numerics.quantities:unit_registry")
"""What is called, and what it keeps; a function of another module works as well, after its import in each fork."""
_LONGEST, _IDLE = 120, 600
"""Seconds after which a function without limits is taken to hang, and after which a child that waits ends."""


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
    with _FORKING.connect() as connection:
        return _answer(connection, function, content, error, limits)


class Kept:
    """A child process that stays for many calls, one at a time; when it has ended, a call starts another.

    It ends when it was not used for ten minutes, since libraries keep a quarter of a gigabyte.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._connection: socket.socket | None = None

    def call(self, function: str, content: bytes, error: type[SlipstickError]) -> bytes:
        """As `call` without limits."""
        with self._lock:
            if self._connection is None or _has_ended(self._connection):
                self._connection = _FORKING.connect()
            return _answer(self._connection, function, content, error)


def _has_ended(connection: socket.socket) -> bool:
    """Whether a child that waits has closed its end; it says nothing of its own accord."""
    try:
        connection.recv(1, socket.MSG_DONTWAIT | socket.MSG_PEEK)
    except BlockingIOError:
        return False
    except OSError:
        pass
    return True


def _answer(connection: socket.socket, function: str, content: bytes, error: type[SlipstickError],
            limits: Limits | None = None) -> bytes:
    asked = {"function": function, "limits": limits and [limits.seconds, limits.memory], "size": len(content)}
    with suppress(OSError), connection.makefile("rb") as file:  # of a child that ends before it has read everything
        connection.sendall(json.dumps(asked).encode() + b"\n")
        connection.sendall(content)
        if said := file.readline():
            refused, failed, size = json.loads(said)
            if refused:
                raise error(*refused)
            if failed:
                raise ChildFailed(failed)
            if len(result := file.read(size)) == size:
                return result
    raise ChildFailed(f"The process of {function} ended without an answer")


class Forking:
    """A process that forks, started when it is needed and again if it was killed.

    Before, it imports modules and calls functions, "module:function", that are `prepared`: forks have what these keep.
    A fork calls the function `main` with its end of a connection, and ends. Libraries have no threads, which would not
    survive a fork, unless `threads`: those of OpenBLAS are made anew.
    """

    def __init__(self, prepared: tuple[str, ...], main: str, threads: bool = False) -> None:
        self._prepared, self._main = prepared, main
        self._environment = {} if threads else {"OPENBLAS_NUM_THREADS": "1"}
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
            arguments = theirs.fileno(), self._prepared, self._main
            command = f"from slipstick.storage.children import serve; serve(*{arguments!r})"
            with unheard():  # Ctrl-C is for this process, with which the other one ends
                self._process = subprocess.Popen(
                    [sys.executable, "-c", command], pass_fds=[theirs.fileno()], cwd=_ROOT, stdin=subprocess.DEVNULL,
                    env={**os.environ, **self._environment})

    def end(self) -> None:
        """End the process that forks, if there is one; forks finish what they compute."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()


_FORKING = Forking(_PREPARED, f"{__name__}:answer_calls")
atexit.register(_FORKING.end)


def serve(descriptor: int, prepared: tuple[str, ...], main: str) -> None:
    """In the process that forks: fork for connections that arrive over the socket `descriptor` until it is closed."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for the forks
    gc.disable()  # all that is imported stays, and would be searched for garbage again and again
    for name in prepared:
        if callable(imported := _named(name)):
            imported()
    gc.freeze()  # a collection in a fork would copy the memory that forks share
    gc.enable()
    with socket.socket(fileno=descriptor) as control:
        while True:
            _, (*descriptors,), _, _ = socket.recv_fds(control, 1, 1)
            if not descriptors:
                return
            with socket.socket(fileno=descriptors[0]) as connection:
                if os.fork() == 0:
                    _become_child(control, connection, main)


def _become_child(control: socket.socket, connection: socket.socket, main: str) -> None:
    try:
        control.close()
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # a child may have children of its own
        _named(main)(connection)
    finally:
        os._exit(0)


def answer_calls(connection: socket.socket) -> None:
    """In a fork: compute one function after the other, until the connection is closed."""
    silence = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # libraries write what they think of a damaged file
        os.dup2(silence, stream)
    with connection.makefile("rwb") as file:
        while line := file.readline():
            asked = json.loads(line)
            if asked["limits"]:
                _limit(*asked["limits"])
            else:
                signal.alarm(_LONGEST)
            refused, failed, result = _compute(asked["function"], file.read(asked["size"]))
            signal.alarm(_IDLE)
            file.write(json.dumps([refused, failed, len(result)]).encode() + b"\n")
            file.write(result)
            file.flush()


def _named(name: str) -> Any:
    """A module, or what a module has: "module:function"."""
    module, _, member = name.partition(":")
    imported = importlib.import_module(module)
    return getattr(imported, member) if member else imported


def _limit(seconds: int, memory: int) -> None:
    os.nice(5)  # what waits for the fork has other requests to answer
    signal.alarm(6 * seconds)
    with suppress(ValueError, OSError):  # not every system limits the address space
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))


def _compute(function: str, content: bytes) -> tuple[tuple[str, str] | None, str | None, bytes]:
    """Cause and remedy of a `SlipstickError`, the traceback of another error, and the result."""
    try:
        result = _named(function)(content)
    except SlipstickError as error:
        return (error.cause, error.remedy), None, b""
    except Exception:
        return None, traceback.format_exc(), b""
    return None, None, result if isinstance(result, bytes) else b""
