"""Build a table in chunks, so that a build killed at any moment resumes where it stopped.

Each finished chunk is a file in a folder beside the table, named after the digest of the plan. The complete table is
written to that folder, verified, and moved to its final path; then the folder is removed.
"""

import fcntl
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import contextmanager
from itertools import islice
from pathlib import Path

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.storage.files import move, replacing
from slipstick.table import Grid

from .executors import explained
from .plan import GridPlan, Runs

Report = Callable[[int, int], None]
"""Called after every chunk with the number of finished engagements and how many of them an earlier build simulated."""


_AHEAD = 200
"""Chunks given to the executor before they are stored, 36 MB: a cheap simulation may be faster than the disk."""
Results = tuple[Path, np.ndarray, np.ndarray]
"""Folder of the chunks, outputs (m, n) and statuses (m, n)."""


def build(plan: GridPlan, out: Path, executor: Executor, report: Report) -> Grid:
    """Simulate `plan` on `executor`, write the table to `out` and return it.

    The result depends neither on the executor nor on interruptions. Raises `InvalidValue` if another process is
    building the same table.
    """
    with simulated(plan, out, executor, report) as (folder, times, status):
        shape = (*plan.shape, len(plan.conditions))
        table = Grid(plan.axes, times.reshape(shape), status.reshape(shape), plan.conditions, plan.model, plan.origin)
        table.write(folder / out.name)
        move(folder / out.name, out)
    return table


@contextmanager
def simulated(plan: Runs, out: Path, executor: Executor, report: Report) -> Iterator[Results]:
    """Yield the folder of chunks, and outputs and statuses (m, n) at all points; after the block, delete the folder.

    Raises `InvalidValue` if another process is building the same table.
    """
    n = len(plan.conditions)
    times = np.empty((plan.chunks[-1].stop, n))
    status = np.empty(times.shape, dtype=np.uint8)
    with _locked_folder(out.with_name(f".{out.name}.{plan.digest[:16]}.parts")) as folder:
        missing = []
        for chunk in plan.chunks:
            stored = _read_chunk(_chunk_path(folder, chunk), (chunk.stop - chunk.start, n))
            if stored:
                times[chunk], status[chunk] = stored
            else:
                missing.append(chunk)
        done = resumed = times.size - sum(chunk.stop - chunk.start for chunk in missing) * n
        report(done, resumed)
        for chunk, *result in _simulate(plan, missing, executor):
            times[chunk], status[chunk] = result
            _write_chunk(_chunk_path(folder, chunk), times[chunk], status[chunk])
            done += times[chunk].size
            report(done, resumed)
        yield folder, times, status
        shutil.rmtree(folder)


def _simulate(plan: Runs, chunks: list[slice], executor: Executor) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
    simulate, left = plan.simulate, iter(chunks)
    futures: dict[Future[tuple[np.ndarray, np.ndarray]], slice] = {}
    try:
        while True:
            for chunk in islice(left, _AHEAD - len(futures)):
                futures[executor.submit(simulate, plan.points(chunk))] = chunk
            if not futures:
                return
            for future in wait(futures, return_when=FIRST_COMPLETED).done:
                with explained():
                    result = future.result()
                yield futures.pop(future), *result
    finally:
        for future in futures:
            future.cancel()


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
            raise InvalidValue("Another process is building this table", "Wait until it ends, or give another --out")
        yield folder
