"""Steps of jobs in a process of their own, stopped when its job is cancelled or its time ends, whatever it is doing.

Compiled code and solvers cannot be interrupted from another thread. A step is a function of the library, a function
that reports progress, and further arguments; it knows nothing of the job database. A step that crashes its process,
such as for lack of memory, fails its job, and not the worker.
"""

import atexit
import gc
import importlib
import math
import multiprocessing
import os
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from slipstick.errors import SlipstickError
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


class Computer:
    """A process for one step at a time, on the tables and recordings in `folder`.

    It starts at once, and another one in its place when it ends, so that no step waits for the import of `modules`.
    """

    def __init__(self, folder: Path, modules: tuple[str, ...]) -> None:
        self.folder, self.modules = folder, modules
        self._lock = threading.Lock()
        self._process, self._connection = self._started()
        atexit.register(self.stop)  # before multiprocessing waits for the process

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
                self._replace()
                raise ComputationLost("The process that computed the job was killed or crashed, such as for lack of "
                                      "memory", "Check the memory of the machine, and submit the job again") from None
            except BaseException:
                self._replace()
                raise

    def stop(self) -> None:
        """End the process, whatever it does."""
        self._process.kill()
        self._process.join()
        self._connection.close()

    def _replace(self) -> None:
        self.stop()
        self._process, self._connection = self._started()

    def _run(self, step: Callable[..., Any], arguments: tuple[Any, ...], report: Callable[[dict[str, Any]], None],
             require_wanted: Callable[[], None], seconds: float) -> Any:
        if not self._process.is_alive():  # killed between two steps
            self._replace()
        connection = self._connection
        begin, kept = time.monotonic(), None
        connection.send((step, arguments))
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

    def _started(self) -> tuple[BaseProcess, Connection]:
        context = multiprocessing.get_context("spawn")  # a fork would copy the locks of other threads
        ours, theirs = context.Pipe()
        # Not a daemon, which could not start the processes of a simulator; see `_end_with_the_worker`.
        process = context.Process(target=_serve, args=(theirs, self.folder, self.modules))
        process.start()
        theirs.close()
        return process, ours


class _StepFailed(Exception):
    """Carries the error of a step, which leaves its process ready for the next one."""

    def __init__(self, reason: Exception) -> None:
        super().__init__()
        self.reason = reason


def _serve(connection: Connection, folder: Path, modules: tuple[str, ...]) -> None:
    """In the process: compute one step after the other, until the worker is gone."""
    threading.Thread(target=_end_with_the_worker, daemon=True).start()
    gc.disable()  # all that is imported stays, and would be searched for garbage again and again
    for module in modules:
        importlib.import_module(module)
    gc.freeze()
    gc.enable()
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


def _end_with_the_worker() -> None:
    worker = multiprocessing.parent_process()
    assert worker is not None
    worker.join()
    os._exit(1)
