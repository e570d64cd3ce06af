"""Build a table chunk by chunk, so that a build killed at any moment goes on where it was.

Every finished chunk is a file in a folder beside the table, named after the digest of what is built. The table itself
is written there too, verified, and moved into place as the last act; then the folder goes.
"""

import fcntl
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, as_completed
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import slipstick
from slipstick.clutch.ensemble import shifting_times
from slipstick.errors import InvalidValue
from slipstick.storage.files import move, replacing
from slipstick.table import Grid
from worker.plan import Plan

Report = Callable[[int, int], None]
"""Told after every chunk: engagements ready, of them left over from an earlier build."""


def build(plan: Plan, out: Path, executor: Executor, report: Report) -> Grid:
    """Simulate `plan` on `executor` and put the table at `out`; return it.

    The result does not depend on the executor, nor on how often the build was cut off. Raises `InvalidValue` where
    another process is building the same table there.
    """
    n = len(plan.conditions)
    times = np.empty((int(np.prod(plan.shape)), n))
    status = np.empty(times.shape, dtype=np.uint8)
    with _sole(out.with_name(f".{out.name}.{plan.digest[:16]}.parts")) as folder:
        missing = []
        for chunk in plan.chunks:
            found = _read(_file(folder, chunk), (chunk.stop - chunk.start, n))
            if found:
                times[chunk], status[chunk] = found
            else:
                missing.append(chunk)
        ready = left_over = times.size - sum(chunk.stop - chunk.start for chunk in missing) * n
        report(ready, left_over)
        for chunk, *result in _simulate(plan, missing, executor):
            times[chunk], status[chunk] = result
            _write(_file(folder, chunk), times[chunk], status[chunk])
            ready += times[chunk].size
            report(ready, left_over)
        table = Grid(plan.axes, times.reshape(*plan.shape, n), status.reshape(*plan.shape, n), plan.conditions,
                     plan.model, f"slipstick {slipstick.__version__}, steps of {plan.accuracy.fine:g} s "
                     f"at contact and {plan.accuracy.coarse:g} s elsewhere, twice that in calm")
        table.write(folder / out.name)
        move(folder / out.name, out)
        shutil.rmtree(folder)
    return table


def _simulate(plan: Plan, chunks: list[slice], executor: Executor) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
    names = [axis.name for axis in plan.axes]
    futures = {executor.submit(shifting_times, plan.model, plan.conditions, names, plan.points(chunk), plan.accuracy,
                               1): chunk for chunk in chunks}
    try:
        for future in as_completed(list(futures)):
            yield futures.pop(future), *future.result()
    finally:
        for future in futures:
            future.cancel()


def _file(folder: Path, chunk: slice) -> Path:
    return folder / f"{chunk.start:010}.npz"


def _write(path: Path, times: np.ndarray, status: np.ndarray) -> None:
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(file, times=times, status=status)


def _read(path: Path, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the chunk in the file, None where there is none or it is damaged (zip members carry a CRC)."""
    try:
        with np.load(path, allow_pickle=False) as file:
            times, status = file["times"], file["status"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    return (times, status) if times.shape == status.shape == shape else None


@contextmanager
def _sole(folder: Path) -> Iterator[Path]:
    """Make `folder` and hold its lock, which the kernel releases however this process ends."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "lock"
    with path.open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            held = path.exists() and os.path.samestat(os.fstat(lock.fileno()), path.stat())
        except BlockingIOError:
            held = False
        if not held:
            raise InvalidValue("Another process is building this table", "Wait until it ends, or give another --out")
        yield folder
