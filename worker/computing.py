"""Steps of jobs in a process of their own, stopped when its job is cancelled or its time ends, whatever it is doing.

Compiled code and solvers cannot be interrupted from another thread. A step is a function of the library, a function
that reports progress, and further arguments; it knows nothing of the job database. A step that crashes its process,
such as for lack of memory, fails its job, and not the worker. The processes are forks of one that has imported what
steps need.
"""

import atexit
import math
import os
import select
import signal
import socket
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from slipstick.errors import SlipstickError
from slipstick.storage.children import Forking
from slipstick.storage.library import Library

_POLL_SECONDS = 0.2


@dataclass(frozen=True, eq=False)
class Report:
    """What a step says while it runs."""

    send: Callable[[tuple[str, Any]], None]

    def __call__(self, progress: dict[str, Any]) -> None:
        """Publish the progress of the job, as JSON."""
        self.send(("progress", progress))

    def say(self, doing: str, done: float | None) -> None:
        """Publish what the step is `doing`, and its share that is complete, if it is known."""
        self({"doing": doing, "done": done})

    def keep(self, result: dict[str, Any]) -> None:
        """Hand over what the step would return if its time ended now."""
        self.send(("kept", result))


class ComputationLost(SlipstickError):
    """The process of a step ended before the step."""


class TimeEnded(Exception):
    """The time of a step ended before it: after `seconds` s, with the result that it had last `kept`, if any."""

    def __init__(self, seconds: float, kept: dict[str, Any] | None) -> None:
        super().__init__()
        self.seconds, self.kept = seconds, kept


def forking_of(modules: tuple[str, ...]) -> Forking:
    """The process whose forks compute steps in these modules; several computers may have the same."""
    return Forking((__name__, *modules), f"{__name__}:serve", threads=True)


class Computer:
    """A process for one step at a time, on the tables and recordings in `folder`.

    It starts at once, and another one in its place when it ends, as a fork of `forking`.
    """

    def __init__(self, folder: Path, forking: Forking) -> None:
        self.folder, self.forking = folder, forking
        self._lock = threading.Lock()
        self._process = self._started()
        atexit.register(self.stop)

    def run(self, step: Callable[..., Any], *arguments: Any, report: Callable[[dict[str, Any]], None],
            require_wanted: Callable[[], None], seconds: float = math.inf) -> Any:
        """Return `step(library, report, *arguments)`, computed in the process within so many `seconds`.

        `report` and `require_wanted`, which is called several times a second, may raise: the process then ends at once.
        Raises what the step raises, `ComputationLost`, and `TimeEnded`, with which the process ends as well.
        """
        with self._lock:  # the step of a cancelled job may still be about to end
            try:
                return self._run(step, arguments, report, require_wanted, seconds)
            except _StepFailed as failure:
                raise failure.reason from None
            except (EOFError, ConnectionError):
                self._process = self._started()
                raise ComputationLost("The process that computed the job was killed or crashed, such as for lack of "
                                      "memory", "Check the memory of the machine, and submit the job again") from None
            except BaseException:
                self.stop()
                self._process = self._started()
                raise

    def stop(self) -> None:
        """End the process, whatever it does."""
        self._process.end()

    def _run(self, step: Callable[..., Any], arguments: tuple[Any, ...], report: Callable[[dict[str, Any]], None],
             require_wanted: Callable[[], None], seconds: float) -> Any:
        if self._process.has_ended():  # killed between two steps
            self._process = self._started()
        begin, kept = time.monotonic(), None
        connection = self._process.begin(step, arguments)
        while True:
            spent = time.monotonic() - begin
            if not connection.poll(min(_POLL_SECONDS, max(0.0, seconds - spent))):
                require_wanted()
            else:
                said, content = connection.recv()
                if said == "result":
                    return content
                if said == "error":
                    raise _StepFailed(content)
                if said == "kept":
                    kept = content
                else:
                    report(content)
            if spent >= seconds:
                raise TimeEnded(spent, kept)

    def _started(self) -> "_Process":
        return _Process(Connection(self.forking.connect().detach()), self.folder)


class _Process:
    """A fork, as the worker sees it: it says its number when it starts, and then nothing before a step."""

    def __init__(self, connection: Connection, folder: Path) -> None:
        self.connection = connection
        connection.send((folder, os.getcwd(), sys.path, sys.argv))

    @cached_property
    def number(self) -> int:
        """The number of the process, which has started."""
        number: int = self.connection.recv()
        return number

    def has_ended(self) -> bool:
        """Whether the process has ended, where it computes no step."""
        try:
            return bool(self.number) and self.connection.poll()
        except (EOFError, OSError):
            return True

    def begin(self, step: Callable[..., Any], arguments: tuple[Any, ...]) -> Connection:
        """Have a step computed; return the connection that it speaks over."""
        if self.number:
            self.connection.send((step, arguments))
        return self.connection

    def end(self) -> None:
        """Kill the process, unless it has ended: its number may be that of another one by now."""
        with suppress(EOFError, OSError):
            number = self.number
            while self.connection.poll():
                self.connection.recv_bytes()
            os.kill(number, signal.SIGKILL)
            while True:  # until it has ended
                self.connection.recv_bytes()
        self.connection.close()


class _StepFailed(Exception):
    """Carries the error of a step, which leaves its process ready for the next one."""

    def __init__(self, reason: Exception) -> None:
        super().__init__()
        self.reason = reason


def serve(end: socket.socket) -> None:
    """In the process: compute one step after the other, until the worker is gone."""
    connection = Connection(end.detach())
    threading.Thread(target=_end_with_the_worker, args=(connection.fileno(),), daemon=True).start()
    connection.send(os.getpid())
    folder, place, sys.path[:], sys.argv[:] = connection.recv()
    os.chdir(place)
    library = Library(folder)
    while True:
        try:
            step, arguments = connection.recv()
        except EOFError:  # the worker has just ended
            return
        try:
            answer = "result", step(library, Report(connection.send), *arguments)
        except SlipstickError as error:
            answer = "error", error
        except Exception as error:
            traceback.print_exc()
            answer = "error", RuntimeError(f"{type(error).__name__}: {error}")  # the error itself may not be picklable
        connection.send(answer)


def _end_with_the_worker(descriptor: int) -> None:
    waiting = select.poll()
    waiting.register(descriptor, 0)  # for nothing but the end of the connection
    waiting.poll()
    os._exit(1)
