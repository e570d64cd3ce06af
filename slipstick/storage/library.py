"""The folder of tables and recordings, in which a file is identified by its name without the extension."""

import os
import re
import secrets
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import h5py

from slipstick.errors import BadRecording, InvalidValue, UnknownName
from slipstick.recordings import Form, Recordings
from slipstick.storage.files import replacing
from slipstick.table import Table

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
_Version = tuple[Path, int, int]
"""Path, modification time in ns and size in bytes: a rebuilt file is a new version."""


@dataclass(frozen=True)
class Library:
    """The tables (.h5) and recordings (.h5, .csv) in `folder`; a file is opened again only if it has changed."""

    folder: Path

    def tables(self) -> list[str]:
        """Names of the tables, sorted."""
        return sorted(path.stem for path in self._files() if _is_table(_version(path)))

    def recordings(self) -> list[str]:
        """Names of the recordings, sorted."""
        return sorted(path.stem for path in self._files() if not _is_table(_version(path)))

    def table(self, name: str) -> Table:
        """Open and verify the table `name`; raises `UnknownName` and what `Table.open` raises."""
        if name not in (known := self.tables()):
            raise UnknownName.of("table", name, known)
        return _open_table(_version(self.folder / f"{name}.h5"))

    def recording(self, name: str) -> Recordings:
        """Open and check the recordings `name`; raises `UnknownName` and what `Recordings.open` raises."""
        if name not in (known := self.recordings()):
            raise UnknownName.of("recordings file", name, known)
        return _open_recordings(_version(next(path for path in self._files() if path.stem == name)))

    def add_recordings(self, name: str, content: bytes, form: Form) -> Recordings:
        """Check the bytes of a recordings file and store them atomically as `name`.

        Raises `BadRecording`, `InvalidValue` if the name is invalid, and `FileExistsError` if it is taken.
        """
        if not _NAME.fullmatch(name):
            raise InvalidValue(f"'{name[:100]}' is not a valid file name",
                               "Use up to 64 letters, digits, - and _, starting with a letter or digit")
        checked = Recordings.read(content, form)
        if any(path.stem == name for path in self._files()):
            raise FileExistsError(name)
        staged = self.folder / f".{name}-{secrets.token_hex(8)}.{form}"
        try:
            with replacing(staged) as temporary:
                temporary.write_bytes(content)
            if _is_table(_version(staged)):
                raise BadRecording("The file has an attribute 'layout', which marks a table", "Remove this attribute")
            # A hard link, unlike a rename, cannot replace a file that another upload has created in the meantime.
            os.link(staged, self.folder / f"{name}.{form}")
        finally:
            staged.unlink(missing_ok=True)
        return checked

    def _files(self) -> list[Path]:
        candidates = (path for path in self.folder.glob("*") if path.suffix in (".h5", ".csv"))
        return [path for path in candidates if _NAME.fullmatch(path.stem)]


def _version(path: Path) -> _Version:
    status = path.stat()
    return path, status.st_mtime_ns, status.st_size


@lru_cache(maxsize=1024)
def _is_table(version: _Version) -> bool:
    path = version[0]
    if path.suffix != ".h5":
        return False
    try:
        with h5py.File(path, "r") as file:
            return "layout" in file.attrs  # recordings do not have it
    except OSError:
        return True  # unreadable: opening it as a table reports the error of the HDF5 library


@lru_cache(maxsize=16)
def _open_table(version: _Version) -> Table:
    return Table.open(version[0])


@lru_cache(maxsize=16)
def _open_recordings(version: _Version) -> Recordings:
    return Recordings.open(version[0])
