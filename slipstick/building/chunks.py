"""Make the runs of a table in chunks, so that a build killed at any moment resumes where it stopped.

Each finished chunk is a file in a folder beside the table, named after the digest of the runs. The complete table is
written to that folder, verified, and moved to its final path; then the folder is removed.
"""

import fcntl
import math
import os
import shutil
import signal
import threading
import zipfile
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from itertools import islice
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np

from slipstick.black_box.simulation import killed
from slipstick.building.plan import GridRuns, Runs, Simulate
from slipstick.errors import InvalidValue
from slipstick.storage.files import move, replacing
from slipstick.table import Axis, Grid

Report = Callable[[int, int], None]
"""Called after every chunk with the number of finished runs and how many of them an earlier build made."""


_AHEAD = 200
"""Chunks given to the executor before they are stored, 36 MB: a cheap simulation may be faster than the disk."""
Results = tuple[Path | None, np.ndarray, np.ndarray]
"""Folder of the chunks if there is one, outputs (m, n) and statuses (m, n)."""


def build_grid(runs: GridRuns, out: Path | None, executor: Executor, report: Report) -> Grid:
    """Make the `runs` on `executor`, write the table to `out`, or to no file, and return it.

    The result depends neither on the executor nor on interruptions. Raises `InvalidValue` if another process is
    building the same table, or if a process of the executor is killed.
    """
    shape = (*runs.shape, len(runs.conditions))
    with complete_chunks(runs, out, executor, report) as (folder, outputs, status):
        table = Grid(runs.axes, outputs.reshape(shape), status.reshape(shape), runs.conditions, runs.model, runs.origin)
        if out is not None and folder is not None:
            move(table.save(folder / out.name), out)
    return table


@contextmanager
def complete_chunks(runs: Runs, out: Path | None, executor: Executor, report: Report) -> Iterator[Results]:
    """Yield the folder of chunks, and outputs and statuses (m, n) at all points; after the block, delete the folder.

    Without `out` there is no folder. Raises `InvalidValue` if another process is building the same table.
    """
    if out is None:
        yield None, *_make(runs, None, executor, report)
        return
    with _locked_folder(out.with_name(f".{out.name}.{runs.digest[:16]}.parts")) as folder:
        yield folder, *_make(runs, folder, executor, report)
        shutil.rmtree(folder)


def require_memory(axes: Sequence[Axis], conditions: int) -> None:
    """Raise `InvalidValue` if memory cannot hold the table twice, as needed to verify the written file, and its check.
    """
    cells = math.prod(len(axis.values) for axis in axes) * conditions
    required, installed = 21 * cells, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if required > installed:
        raise InvalidValue(f"A table of {cells:,} runs needs {required / 1e9:,.0f} GB of memory, and this machine has "
                           f"{installed / 1e9:,.0f} GB", "Give fewer points per axis, or fewer axes")


def _make(runs: Runs, folder: Path | None, executor: Executor, report: Report) -> tuple[np.ndarray, np.ndarray]:
    """Outputs and statuses (m, n) of all runs, of which chunks are kept in `folder`."""
    n = len(runs.conditions)
    outputs = np.empty((runs.chunks[-1].stop, n))
    status = np.empty(outputs.shape, dtype=np.uint8)
    missing = []
    for chunk in runs.chunks:
        kept = None if folder is None else _read_chunk(_chunk_path(folder, chunk), (chunk.stop - chunk.start, n))
        if kept:
            outputs[chunk], status[chunk] = kept
        else:
            missing.append(chunk)
    done = resumed = outputs.size - sum(chunk.stop - chunk.start for chunk in missing) * n
    report(done, resumed)
    with closing(simulate_chunks(runs.simulate, runs.points, missing, executor)) as results:
        for chunk, *result in results:
            outputs[chunk], status[chunk] = result
            if folder is not None:
                _write_chunk(_chunk_path(folder, chunk), outputs[chunk], status[chunk])
            done += outputs[chunk].size
            report(done, resumed)
    return outputs, status


def simulate_chunks(simulate: Simulate, points: Callable[[slice], np.ndarray], chunks: Sequence[slice],
                    executor: Executor) -> Generator[tuple[slice, np.ndarray, np.ndarray]]:
    """Each chunk with its outputs and statuses, as soon as `executor` has made its runs, in any order.

    Ctrl-C ends it between two chunks. Raises `InvalidValue` if a process of the executor is killed.
    """
    left, done = iter(chunks), SimpleQueue[Future[tuple[np.ndarray, np.ndarray]] | None]()
    futures: dict[Future[tuple[np.ndarray, np.ndarray]], slice] = {}
    with _deferred_interrupts(done) as interrupts:
        try:
            while True:
                for chunk in islice(left, _AHEAD - len(futures)):
                    future = executor.submit(simulate, points(chunk))
                    futures[future] = chunk
                    future.add_done_callback(done.put)
                if not futures:
                    return
                finished = done.get()
                if finished is None or interrupts:
                    raise KeyboardInterrupt
                yield futures.pop(finished), *finished.result()
        except BrokenProcessPool as error:
            raise killed() from error
        finally:
            for future in futures:
                future.cancel()


@contextmanager
def _deferred_interrupts(queue: SimpleQueue[Any]) -> Iterator[list[int]]:
    """Let Ctrl-C in the block put None into `queue`, and a number into the list, instead of raising an exception.

    An exception amid the functions of futures would leave their locks held, for which the threads of an executor, and
    so the end of the program, would wait for ever.
    """
    interrupts: list[int] = []

    def interrupt(number: int, frame: object) -> None:
        interrupts.append(number)
        queue.put(None)

    is_deferred = (threading.current_thread() is threading.main_thread()
                   and signal.getsignal(signal.SIGINT) is signal.default_int_handler)
    if is_deferred:
        signal.signal(signal.SIGINT, interrupt)
    try:
        yield interrupts
    finally:
        if is_deferred:
            signal.signal(signal.SIGINT, signal.default_int_handler)
    if interrupts:
        raise KeyboardInterrupt


def _chunk_path(folder: Path, chunk: slice) -> Path:
    return folder / f"{chunk.start:010}.npz"


def _write_chunk(path: Path, times: np.ndarray, status: np.ndarray) -> None:
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(file, times=times, status=status)


def _read_chunk(path: Path, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray] | None:
    """Times and status in the file; None if it is missing or damaged, which the CRC of its zip members shows."""
    try:
        with np.load(path, allow_pickle=False) as file:
            times, status = file["times"], file["status"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    return (times, status) if times.shape == status.shape == shape else None


@contextmanager
def _locked_folder(folder: Path) -> Iterator[Path]:
    """Create `folder` and hold its lock, which the kernel releases however this process ends."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "lock"
    with path.open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Another build may have removed the folder before the lock was taken.
            is_locked = path.exists() and os.path.samestat(os.fstat(lock.fileno()), path.stat())
        except BlockingIOError:
            is_locked = False
        if not is_locked:
            raise InvalidValue("Another process is building this table", "Wait until it ends, or write to another file")
        yield folder
