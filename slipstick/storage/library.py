"""The folder of benches, tables and recordings, in which a file is identified by its name without the extension."""

import io
import os
import re
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np

from slipstick.bench import Bench, Physics
from slipstick.bench.reader import read
from slipstick.black_box import BlackBoxDescription, Measurements
from slipstick.black_box.measurements import MARK
from slipstick.errors import (
    BadBench,
    BadRecording,
    BadTable,
    InvalidValue,
    LimitExceeded,
    NoFolder,
    UnknownName,
)
from slipstick.machine import Runs
from slipstick.machine.runs_file import read_untrusted_runs
from slipstick.recordings import Form, Recordings
from slipstick.storage.files import replacing
from slipstick.storage.versions import (
    Version,
    derive,
    describes_machine,
    holds_table,
    known_table,
    marks,
    open_bench,
    open_recordings,
    open_table,
    readable,
    version_of,
)
from slipstick.table import Table
from slipstick.table.upload import verify

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
_T = TypeVar("_T")
FileKind = Literal["table", "recordings file", "bench"]
_OTHER_LINES = 1000
"""Lines of a CSV file that may be remarks."""
_FEWER_ENGAGEMENTS = "Split the file, or let the administrator increase SLIPSTICK_ENGAGEMENTS"


@dataclass(frozen=True)
class Library:
    """Benches (.toml), tables and recordings (.h5) in `folder`; a file is opened again only if it has changed."""

    folder: Path
    most_bytes: int | None = None
    """Maximum size of all files in the folder together, in bytes, once a file is added."""
    most_engagements: int | None = None
    """Maximum number of engagements of added recordings."""

    def require_folder(self) -> None:
        """Raise `NoFolder` if the folder does not exist: what it holds is then not known."""
        if not self.folder.is_dir():
            raise NoFolder(f"The folder '{self.folder}' does not exist",
                           "Set SLIPSTICK_TABLES to the folder that contains the tables")

    def benches(self) -> list[str]:
        """Names of the bench files, sorted."""
        return sorted(path.stem for path in self._files(".toml") if not describes_machine(path))

    def bench(self, name: str) -> Bench:
        """Open and check the bench `name`; raises `UnknownName` and `BadBench`."""
        return self._read_bench(name, open_bench)

    def derive_from_bench(self, name: str, function: Callable[[Bench], _T]) -> _T:
        """Return what a `function` of a module makes of the bench `name`: little, which is kept longer than the bench.

        Raises what `bench` raises.
        """
        return self._read_bench(name, lambda version: derive(version, open_bench, function))

    def _read_bench(self, name: str, read: Callable[[Version], _T]) -> _T:
        if not self.has_bench(name):
            raise UnknownName.of("bench", name, self.benches())
        with readable(self.folder / f"{name}.toml", BadBench) as version:
            return read(version)

    def bench_of_model(self, physics: Physics) -> str:
        """Name of the bench whose physics this is, that of a model; raises `UnknownName`."""
        return self._require_single([name for name, bench in self._valid_benches() if bench.digest == physics.digest],
                                    "the physics of this table")

    def bench_of_recordings(self, recordings: Recordings) -> str:
        """Name of the bench with the current profiles of these recordings; raises `UnknownName`."""
        profiles = np.array([recordings.conditions.profile_time, recordings.conditions.profile_current])
        # Units converted to those of the model, and decimal numbers read by other programs, differ in the last bit.
        return self._require_single([name for name, bench in self._valid_benches()
                                     if (own := np.array(bench.profiles[:2])).shape == profiles.shape
                                     and np.allclose(own, profiles)],
                                    "the current profiles of these recordings")

    def tables(self) -> list[str]:
        """Names of the tables, sorted."""
        return sorted(path.stem for path in self._files() if holds_table(path))

    def recordings(self) -> list[str]:
        """Names of the recordings, sorted."""
        return sorted(path.stem for path in self._files() if not holds_table(path))

    def has_bench(self, name: str) -> bool:
        """Whether there is a bench of this name, valid or not; the folder is not listed."""
        return (path := self._file(name, "toml")) is not None and not describes_machine(path)

    def has_table(self, name: str) -> bool:
        """Whether there is a table of this name, valid or not; the folder is not listed."""
        return (path := self._file(name)) is not None and holds_table(path)

    def has_recordings(self, name: str) -> bool:
        """Whether there are recordings of this name, valid or not; the folder is not listed."""
        return (path := self._file(name)) is not None and not holds_table(path)

    def table_in_memory(self, name: str) -> Table | None:
        """The table `name` if its file need not be read again, otherwise None."""
        if _NAME.fullmatch(name):
            with suppress(OSError):  # there is no such file
                return known_table(version_of(self.folder / f"{name}.h5"))
        return None

    def table(self, name: str) -> Table:
        """Open and verify the table `name`; raises `UnknownName` and what `Table.open` raises."""
        if (known := self.table_in_memory(name)) is not None:
            return known
        return self._read_table(name, open_table)

    def derive_from_table(self, name: str, function: Callable[[Table], _T]) -> _T:
        """As `derive_from_bench`, of the table `name`; raises what `table` raises."""
        return self._read_table(name, lambda version: derive(version, open_table, function))

    def _read_table(self, name: str, read: Callable[[Version], _T]) -> _T:
        if not self.has_table(name):
            raise self._other_kind("table", name, self.tables(), "recordings", self.has_recordings(name))
        with readable(self.folder / f"{name}.h5", BadTable) as version:
            return read(version)

    @staticmethod
    def _other_kind(kind: str, name: str, known: list[str], other: str, is_other: bool) -> UnknownName:
        """The error about a name that is none of a kind, which says so where it is one of the `other` kind."""
        error = UnknownName.of(kind, name, known)
        return UnknownName(f"{error.cause}: '{name}' is {other}", error.remedy) if is_other else error

    def recording(self, name: str) -> Recordings:
        """Open and check the recordings `name` of a clutch; raises `UnknownName` and what `Recordings.open` raises."""
        measured = self.measured(name)
        if isinstance(measured, Measurements):
            raise InvalidValue(f"'{name}' holds measurements of another machine ({measured.output.name})",
                               "Give recordings of a clutch")
        return measured

    def measured(self, name: str) -> Recordings | Measurements:
        """As `recording`, or the measurements `name` of another machine; raises the same errors."""
        recorded = self.recorded(name)
        if isinstance(recorded, Runs):
            raise InvalidValue(f"'{name}' holds runs of the machine '{recorded.machine}'",
                               "Study them, or upload the measured output of each as a CSV file")
        return recorded

    def recorded(self, name: str) -> Recordings | Measurements | Runs:
        """As `measured`, or the runs `name` of a declared machine; raises the same errors."""
        return self._read_recorded(name, open_recordings)

    def derive_from_recorded(self, name: str, function: Callable[[Recordings | Measurements | Runs], _T]) -> _T:
        """As `derive_from_bench`, of the recordings `name`; raises what `recorded` raises."""
        return self._read_recorded(name, lambda version: derive(version, open_recordings, function))

    def _read_recorded(self, name: str, read: Callable[[Version], _T]) -> _T:
        if not self.has_recordings(name):
            raise self._other_kind("recordings file", name, self.recordings(), "a table", self.has_table(name))
        with readable(self.folder / f"{name}.h5", BadRecording) as version:
            return read(version)

    def add_bench(self, name: str, content: bytes) -> Bench:
        """Check the bytes of a bench file and store them atomically as `name`.

        Raises `BadBench`, `LimitExceeded`, `InvalidValue` if the name is invalid, and `FileExistsError` if it is taken.
        """
        require_name(name)
        bench = read(content, f"{name}.toml")
        self._store(name, content, "toml")
        return bench

    def add_table(self, name: str, content: bytes) -> bool:
        """Verify the bytes of a table in a limited child process and store them atomically as `name`.

        Returns whether the table is new: False if the same one has this name already. Raises `RefusedTable`,
        `LimitExceeded`, `InvalidValue` if the name is invalid, and `FileExistsError` if another file has it.
        """
        require_name(name)
        digest, written = verify(content)
        try:
            self._store(name, written, "h5")
        except FileExistsError:
            if name not in self.tables() or self.table(name).digest != digest:
                raise
            return False
        return True

    def add_recordings(self, name: str, content: bytes, form: Form, bench: str | None = None) -> Recordings | Runs:
        """Check the bytes of a recordings file and store them atomically as `name`, a CSV as HDF5.

        An HDF5 file may have runs of a declared machine. A CSV numbers the current profiles of the `bench`. Raises
        `BadRecording`, `UnknownName`, `LimitExceeded`, `InvalidValue` if the name is invalid, and `FileExistsError` if
        it is taken.
        """
        require_name(name)
        if form == "csv" and self.most_engagements is not None:
            lines = content.count(b"\n")  # counted first, because reading millions of rows takes minutes
            if lines > self.most_engagements + _OTHER_LINES:
                raise LimitExceeded(f"The file has {lines:,} lines; the limit is {self.most_engagements:,} engagements",
                                    _FEWER_ENGAGEMENTS)
        checked = self.read_recordings(content, form, bench)
        self._require_engagements(len(checked))
        # They are checked in another way, and must not be read as measurements.
        if form == "h5" and MARK in marks(io.BytesIO(content)):
            raise BadRecording(f"The file has an attribute '{MARK}', which marks measurements of another machine",
                               "Remove this attribute, or upload the measurements as CSV")
        self._store(name, content if isinstance(checked, Runs) or form == "h5" else checked.to_bytes(), "h5")
        return checked

    def add_measurements(self, name: str, content: bytes, table: str) -> Measurements:
        """Check the bytes of a CSV of measurements of the machine of a `table`, and store them atomically as `name`.

        Raises what `add_recordings` raises, and `InvalidValue` if the table is one of a clutch.
        """
        require_name(name)
        checked = self.read_measurements(content, table)
        self._require_engagements(len(checked))
        self._store(name, checked.to_bytes(), "h5")
        return checked

    def read_measurements(self, content: bytes, table: str) -> Measurements:
        """Check the bytes of a CSV of measurements; raises `BadRecording`, `UnknownName`, `InvalidValue`."""
        machine = self.table(table).model
        if not isinstance(machine, BlackBoxDescription):
            raise InvalidValue(f"The table '{table}' is one of a clutch", "Name the bench of the recordings instead")
        return Measurements.read_csv(content, machine)

    def read_recordings(self, content: bytes, form: Form, bench: str | None = None) -> Recordings | Runs:
        """Check the bytes of a recordings file; raises `BadRecording`, `UnknownName`."""
        if form == "h5" and (runs := read_untrusted_runs(content)) is not None:
            return runs
        return Recordings.read(content, form, profiles=None if bench is None else self.bench(bench).profiles)

    def staged_table(self, name: str) -> Path:
        """The hidden file to which the table `name` is built, beside the parts of a build that goes on."""
        return self.folder / f".build-{name}.h5"

    def keep_staged_table(self, name: str) -> None:
        """Give the table that was built to `staged_table` its name; raises `InvalidValue` if another file has it."""
        staged = self.staged_table(name)
        try:
            os.link(staged, self.folder / f"{name}.h5")
        except FileExistsError:
            # The same table is there if the worker ended just after it had got its name.
            if not self.has_table(name) or self.table(name).digest != Table.open(staged).digest:
                raise InvalidValue(f"Another file was named '{name}' while the table was built",
                                   "Submit the build again under another name") from None
        staged.unlink()

    def remove_staged_table(self, name: str) -> None:
        """Delete what a build of the table `name` has kept that did not end."""
        self.staged_table(name).unlink(missing_ok=True)
        for folder in self.folder.glob(f".{self.staged_table(name).name}.*.parts"):
            shutil.rmtree(folder, ignore_errors=True)

    def remove(self, kind: FileKind, name: str) -> None:
        """Delete the file `name` of a kind, valid or not; raises `UnknownName`."""
        path = self._known_file(kind, name)
        with _change(kind, name):
            path.unlink()

    def rename(self, kind: FileKind, name: str, new: str) -> None:
        """Rename the file `name` of a kind, valid or not.

        Raises `UnknownName`, `InvalidValue` if the new name is invalid, and `FileExistsError` if it is taken.
        """
        require_name(new)
        old = self._known_file(kind, name)
        linked = old.with_stem(new)
        with _change(kind, name):
            os.link(old, linked, follow_symlinks=False)  # a rename could replace a file
            try:
                old.unlink()
            except FileNotFoundError:  # another request has deleted or renamed it in the meantime
                linked.unlink(missing_ok=True)
                raise

    def _known_file(self, kind: FileKind, name: str) -> Path:
        known = {"table": self.tables, "recordings file": self.recordings, "bench": self.benches}[kind]()
        if name not in known:
            raise UnknownName.of(kind, name, known)
        return self.folder / f"{name}.{'toml' if kind == 'bench' else 'h5'}"

    def _require_engagements(self, count: int) -> None:
        if self.most_engagements is not None and count > self.most_engagements:
            raise LimitExceeded(f"The recordings have {count:,} engagements; the limit is {self.most_engagements:,}",
                                _FEWER_ENGAGEMENTS)

    def require_space(self, size: int) -> None:
        """Raise `LimitExceeded` if the folder cannot take a file of this `size` in bytes."""
        if self.most_bytes is None:
            return
        stored = 0
        for path in (*self._files(), *self._files(".toml"), *self.folder.glob("..build-*.parts/*")):
            with suppress(OSError):  # deleted in the meantime
                stored += path.lstat().st_size
        if stored + size > self.most_bytes:
            raise LimitExceeded(f"The folder holds {stored:,} bytes, and {size:,} more exceed its {self.most_bytes:,}",
                                "Delete tables, recordings or builds that ended early, or let the administrator "
                                "increase SLIPSTICK_FOLDER_BYTES")

    def _store(self, name: str, content: bytes, form: str) -> None:
        if any(path.stem == name for path in self._files(f".{form}")):
            raise FileExistsError(name)
        self.require_space(len(content))
        staged = self.folder / f".{name}-{secrets.token_hex(8)}.{form}"
        try:
            with replacing(staged) as temporary:
                temporary.write_bytes(content)
            # A hard link, unlike a rename, cannot replace a file that another upload has created in the meantime.
            os.link(staged, self.folder / f"{name}.{form}")
        finally:
            staged.unlink(missing_ok=True)

    def _valid_benches(self) -> Iterator[tuple[str, Bench]]:
        for name in self.benches():
            with suppress(BadBench):  # opening it by its name reports the error
                yield name, self.bench(name)

    def _require_single(self, names: list[str], what: str) -> str:
        if len(names) != 1:
            raise UnknownName(f"{'No bench has' if not names else 'More than one bench has'} {what}",
                              f"Name the bench. Known: {', '.join(self.benches()) or 'none'}")
        return names[0]

    def _file(self, name: str, form: str = "h5") -> Path | None:
        path = self.folder / f"{name}.{form}"
        if _NAME.fullmatch(name) and os.path.lexists(path):
            return path
        self.require_folder()
        return None

    def _files(self, suffix: str = ".h5") -> list[Path]:
        self.require_folder()
        return [path for path in self.folder.glob(f"*{suffix}") if _NAME.fullmatch(path.stem)]


@contextmanager
def _change(kind: FileKind, name: str) -> Iterator[None]:
    """Raise `UnknownName` if the file that is deleted or renamed vanishes meanwhile, `InvalidValue` if it must stay."""
    try:
        yield
    except FileExistsError:
        raise
    except FileNotFoundError:
        raise UnknownName(f"The {kind} '{name}' was deleted or renamed at the same time",
                          "List the files, and choose one of them") from None
    except OSError as error:
        raise InvalidValue(f"The {kind} '{name}' cannot be deleted or renamed ({error.strerror})",
                           "Let the administrator of the service check the folder of the tables") from error


def require_name(name: str) -> None:
    """Raise `InvalidValue` for a text that is no name of a file."""
    if not _NAME.fullmatch(name):
        raise InvalidValue(f"'{name[:100]}' is not a valid file name",
                           "Use up to 64 letters, digits, - and _, starting with a letter or digit")
