"""The workers of a Dask scheduler as an executor of `concurrent.futures`.

Simulations of a worker that dies are repeated on another one. Each task carries the digest of the program that sent it,
and a worker with another program refuses it: results are the same on any number of workers, or there are none.
"""

import hashlib
import multiprocessing
import os
import socket
import sys
from collections.abc import Callable
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import slipstick
from slipstick.errors import InvalidValue

_SECONDS = 30.0
"""Longest time to wait for the scheduler, and then for its first worker."""
_NUMERICAL = ("numpy", "scipy", "numba", "llvmlite")
_REMEDY = "Start the workers with the same version of Slipstick, numpy, scipy and numba as this program"


class ClusterLost(Exception):
    """A task could not be computed, because the workers that had it died."""


class Cluster(Executor):
    """The workers of the scheduler at `address`, which join and leave at any time.

    `needs_main_thread` runs each task in a process of its own on the worker, as Python callables with a timeout need,
    `needs_one_thread` refuses workers that run several tasks in one process. Raises `InvalidValue`.
    """

    def __init__(self, address: str, needs_main_thread: bool = False, needs_one_thread: bool = False) -> None:
        try:
            from distributed import Client, KilledWorker
            from distributed.comm import get_address_host_port
        except ImportError:
            raise InvalidValue("Dask is not installed", "pip install 'slipstick[dask]'") from None
        try:
            # First without a client: one that fails to connect leaves a thread behind, which disturbs the next one.
            socket.create_connection(get_address_host_port(address, strict=True), timeout=_SECONDS).close()
            self._client = Client(address, timeout=_SECONDS, set_as_default=False)
        except (OSError, ValueError, ImportError) as error:
            raise InvalidValue(f"There is no Dask scheduler at '{address}': {error}",
                               "Start one with `python -m dask scheduler`, and give its address") from None
        self._call = _in_process if needs_main_thread else _here
        self._killed = KilledWorker
        try:
            self._require_workers(address, needs_one_thread)
        except BaseException:
            self._client.close()
            raise
        self._executor = self._client.get_executor(pure=False)

    @property
    def threads(self) -> int:
        """Number of tasks that the workers compute at once."""
        counts: dict[str, int] = self._client.nthreads()
        return max(1, sum(counts.values()))

    @property
    def is_connected(self) -> bool:
        """Whether the scheduler is there."""
        return bool(self._client.status == "running")

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """Compute on one of the workers; `InvalidValue` is the result on one with another program."""
        future: Future[Any] = self._executor.submit(self._call, program_digest(), function, *arguments, **named)
        told: Future[Any] = Future()
        future.add_done_callback(lambda done: self._tell(done, told))
        told.add_done_callback(lambda done: future.cancel() if done.cancelled() else None)
        return told

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster, which goes on."""
        self._executor.shutdown(wait and self.is_connected)
        self._client.close()

    def _tell(self, done: Future[Any], told: Future[Any]) -> None:
        if told.cancelled() or not told.set_running_or_notify_cancel():
            return
        if done.cancelled():
            told.set_exception(ClusterLost("the scheduler has ended"))
        elif error := done.exception():
            told.set_exception(ClusterLost(str(error)) if isinstance(error, self._killed) else error)
        else:
            told.set_result(done.result())

    def _require_workers(self, address: str, needs_one_thread: bool) -> None:
        try:
            self._client.wait_for_workers(1, timeout=_SECONDS)
        except TimeoutError:
            raise InvalidValue(f"The Dask scheduler at '{address}' has no workers",
                               f"Start one on each machine with `python -m dask worker {address}`") from None
        if needs_one_thread and max(self._client.nthreads().values()) > 1:
            raise InvalidValue("A Dask worker runs several tasks in one process, which this computation does not allow",
                               "Start the workers with --nworkers N --nthreads 1")
        for worker, digest in self._told(program_digest).items():
            _require_same(digest, program_digest(), f"The Dask worker {worker}")
        processors = {*self._told(_processor).values(), _processor()}
        if len(processors) > 1:
            print(f"The machines have different processors ({', '.join(sorted(processors))}): results may differ from "
                  "those of one machine in the last digits, and digests with them", file=sys.stderr)

    def _told(self, function: Callable[[], str]) -> dict[str, str]:
        """What `function` gives on each worker that can be reached.

        One that has just ended is known to the scheduler for a moment; one that comes back shows its program with every
        task.
        """
        answers: dict[str, Any] = self._client.run(function, on_error="return")
        reached = {worker: answer for worker, answer in answers.items() if not isinstance(answer, OSError)}
        for worker, error in reached.items():
            if isinstance(error, Exception):  # whatever the import of another version raises
                raise InvalidValue(f"The Dask worker {worker} cannot load Slipstick: {error}", _REMEDY)
        return reached


@cache
def program_digest() -> str:
    """SHA-256 of the sources of Slipstick and of the versions of the numerical libraries."""
    root = Path(slipstick.__path__[0])
    hashed = hashlib.sha256(" ".join(f"{name} {version(name)}" for name in _NUMERICAL).encode())
    for path in sorted(root.rglob("*.py")):
        hashed.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return hashed.hexdigest()


def _processor() -> str:
    from llvmlite import binding

    return str(binding.get_host_cpu_name())  # for which numba compiles


def _here(digest: str, function: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
    """On a worker: compute in this thread."""
    _require_same(program_digest(), digest, "A Dask worker")
    return function(*arguments, **named)


def _in_process(digest: str, function: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
    """On a worker: compute in the main thread of another process."""
    _require_same(program_digest(), digest, "A Dask worker")
    try:
        return _processes().submit(function, *arguments, **named).result()
    except BrokenProcessPool:
        _processes.cache_clear()
        raise InvalidValue("A process of the simulator was killed or crashed on a Dask worker",
                           "Correct what ends it, such as a lack of memory; the same command resumes a build") from None


@cache
def _processes() -> Executor:
    from slipstick.black_box.simulation import start_processes

    if multiprocessing.current_process().daemon:
        raise InvalidValue("A Dask worker may not start the processes of a Python callable",
                           "Start the workers with the environment variable DASK_DISTRIBUTED__WORKER__DAEMON=False")
    return start_processes(os.cpu_count() or 1)


def _require_same(digest: str, expected: str, whose: str) -> None:
    if digest != expected:
        raise InvalidValue(f"{whose} has another version of Slipstick or of its numerical libraries", _REMEDY)
