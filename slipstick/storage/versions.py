"""The files of a library, each opened again only if it has changed, and what kind of file each is."""

import io
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar
from weakref import WeakValueDictionary

import h5py

from slipstick.bench import Bench
from slipstick.black_box import Measurements, is_black_box
from slipstick.black_box.measurements import MARK
from slipstick.errors import SlipstickError
from slipstick.machine import Runs, read_runs
from slipstick.machine.runs_file import MARK as RUNS_MARK
from slipstick.recordings import Recordings
from slipstick.table import Table

_Content = TypeVar("_Content")
_T = TypeVar("_T")
Version = tuple[Path, int, int]
"""Path, modification time in ns and size in bytes: a rebuilt file is a new version."""
_KEPT = 8192
"""Number of files of which little is kept, such as their kind; of few, the content is."""


def version_of(path: Path) -> Version:
    """The version of a file as it is now; raises `OSError` if there is none."""
    status = path.stat()
    return path, status.st_mtime_ns, status.st_size


@contextmanager
def readable(path: Path, error: type[SlipstickError]) -> Iterator[Version]:
    """Yield the version of a file; raises `error` if it is no regular file or vanishes meanwhile."""
    try:
        if path.is_file():  # opening a pipe would wait for ever
            yield version_of(path)
            return
    except FileNotFoundError:
        pass
    raise error(f"'{path.name}' is not a file, or a link whose target is missing", "Restore the file, or delete it")


def holds_table(path: Path) -> bool:
    """Whether the file is a table, or no file that could be anything else: opening it as a table reports the error."""
    try:
        return not path.is_file() or _is_table(version_of(path))
    except FileNotFoundError:
        return True


def describes_machine(path: Path) -> bool:
    """Whether the file describes another machine, which only the worker reads."""
    with suppress(OSError):
        return path.is_file() and _is_machine(version_of(path))
    return False


@lru_cache(maxsize=_KEPT)
def _is_machine(version: Version) -> bool:
    return is_black_box(version[0])


@lru_cache(maxsize=_KEPT)
def _is_table(version: Version) -> bool:
    try:
        return "layout" in marks(version[0])
    except OSError:
        return True  # unreadable: opening it as a table reports the error of the HDF5 library


def marks(file: Path | io.BytesIO) -> set[str]:
    """The attributes of a file by which it is no recordings of a clutch."""
    with h5py.File(file, "r") as opened:
        return {name for name in ("layout", MARK, RUNS_MARK) if name in opened.attrs}


_READ: WeakValueDictionary[Version, Table] = WeakValueDictionary()
"""The tables that `open_table` returns without reading them."""
_OPENING = threading.Lock()
"""Held while a table is read: who asks for the same one meanwhile gets it, instead of a second one that is not kept."""


def known_table(version: Version) -> Table | None:
    """The table of this version if it need not be read, otherwise None."""
    return _READ.get(version)


def open_table(version: Version) -> Table:
    """Read and verify a table; raises what `Table.open` raises."""
    with _OPENING:
        _READ[version] = table = _open_verified(version)
    return table


@lru_cache(maxsize=16)
def _open_verified(version: Version) -> Table:
    return Table.open(version[0])


@lru_cache(maxsize=16)
def open_recordings(version: Version) -> Recordings | Measurements | Runs:
    """Read and check recordings of a clutch, or measurements or runs of another machine; raises `BadRecording`."""
    marked = set[str]()
    with suppress(OSError):  # opening it as recordings reports the error of the HDF5 library
        marked = marks(version[0])
    if RUNS_MARK in marked:
        return read_runs(version[0])
    return Measurements.read(version[0]) if MARK in marked else Recordings.open(version[0])


@lru_cache(maxsize=16)
def open_bench(version: Version) -> Bench:
    """Read and check a bench; raises `BadBench`."""
    return Bench.open(version[0])


def derive(version: Version, open_file: Callable[[Version], _Content], function: Callable[[_Content], _T]) -> _T:
    """Return what a `function` of a module makes of a file, which is not opened for it again; raises what opening does.

    It is small, because it is kept much longer than the content of the file.
    """
    derived: _T = _derive(version, open_file, function)
    return derived


@lru_cache(maxsize=4 * _KEPT)
def _derive(version: Version, open_file: Callable[[Version], Any], function: Callable[[Any], Any]) -> Any:
    return function(open_file(version))
