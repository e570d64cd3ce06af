"""Uploaded files with their mapping, as a ZIP archive, imported in a limited child process."""

import io
import json
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from slipstick.acquisition.channel import Source
from slipstick.acquisition.importing import import_sources
from slipstick.acquisition.mapping import ChannelMap
from slipstick.acquisition.mapping_file import read_mapping
from slipstick.acquisition.opening import FORMATS, is_hidden, is_measurement, open_source
from slipstick.acquisition.result import SetAside
from slipstick.bench import Bench
from slipstick.errors import BadRecording
from slipstick.storage.isolated import isolated

MAPPING = "channels.toml"
"""Name of the mapping in an archive."""

_MOST_FILES, _MOST_BYTES = 5000, 1 << 30
_SECONDS = 120  # of processor time
_FAILED = "The import of the archive crashes, or needs more than two minutes or 4 GB"


@dataclass(frozen=True)
class ImportReport:
    """What must be known about imported recordings; see `Imported`."""

    engagements: tuple[str, ...]
    computed: bool
    set_aside: tuple[SetAside, ...]
    remarks: tuple[str, ...]
    doubts: tuple[str, ...]
    open_questions: tuple[str, ...]


def import_archive(content: bytes, bench: Path) -> tuple[bytes, ImportReport]:
    """Recordings as HDF5, and what must be known about them, of the bytes of an archive with files of a `bench` file.

    The archive has the mapping as `channels.toml`, the files, and the sheet of conditions if the mapping names one;
    folders are ignored. Everything is read in a limited child process. Raises `BadRecording`.
    """
    request = json.dumps({"bench": str(bench.resolve())}).encode() + b"\n" + content
    answer = isolated(request, "slipstick.acquisition.archive:answer", BadRecording, _SECONDS, _FAILED)
    said, _, recordings = answer.partition(b"\n")
    report = json.loads(said)
    aside = tuple(SetAside(entry["label"], entry["reason"]) for entry in report["set_aside"])
    return recordings, ImportReport(tuple(report["engagements"]), report["computed"], aside, *(
        tuple(report[name]) for name in ("remarks", "doubts", "open_questions")))


def answer(request: bytes) -> bytes:
    """In the child process: a line with the report as JSON, and the recordings as HDF5."""
    said, _, content = request.partition(b"\n")
    files = _files(content)
    mapping = read_mapping(_take_file(files, MAPPING, "the mapping"), MAPPING)
    plan = None if mapping.plan is None else _take_file(files, mapping.plan, "the sheet of conditions")
    left_out = [path.as_posix() for path in files if not is_measurement(path)]
    runs = {path.name: read for path, read in files.items() if is_measurement(path)}
    if not runs:
        raise BadRecording("The archive has no file of a known kind beside the mapping",
                           f"Known are names in {', '.join(FORMATS)}")
    imported = import_sources(_sources(runs, mapping), mapping, Bench.open(json.loads(said)["bench"]), plan)
    remarks = [*imported.remarks, *(f"left out of the archive, because of their names: {', '.join(left_out[:10])}"
                                    for _ in left_out[:1])]
    report = {"engagements": imported.labels, "computed": imported.computed,
              "set_aside": [{"label": entry.label, "reason": entry.reason} for entry in imported.set_aside],
              "remarks": remarks, "doubts": imported.doubts, "open_questions": imported.open_questions}
    return json.dumps(report).encode() + b"\n" + imported.recordings.to_bytes()


def _files(content: bytes) -> dict[PurePosixPath, bytes]:
    """The files by their paths, but for those that systems hide; raises `BadRecording`."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = [entry for entry in archive.infolist() if not entry.is_dir()]
            if len(entries) > _MOST_FILES or sum(entry.file_size for entry in entries) > _MOST_BYTES:
                raise BadRecording(f"The archive has more than {_MOST_FILES:,} files or {_MOST_BYTES:,} bytes",
                                   "Split it, or import on the machine itself: `slipstick import`")
            # Programs of Windows may separate folders by a backslash.
            paths = [PurePosixPath(entry.filename.replace("\\", "/")) for entry in entries]
            files = {path: archive.read(entry) for path, entry in zip(paths, entries, strict=True)
                     if not is_hidden(path)}
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, OSError, ValueError, EOFError, zlib.error) as error:
        raise BadRecording(f"The request body is not a readable ZIP archive ({str(error)[:100]})",
                           "Create it anew, without a password, such as zip -r files.zip channels.toml runs") from None
    names = [path.name for path in files if is_measurement(path) or path.name == MAPPING]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise BadRecording(f"The archive has two files '{twice}'", "Give each file a name of its own")
    return files


def _take_file(files: dict[PurePosixPath, bytes], name: str, what: str) -> bytes:
    """Remove a file by its name, and return its content."""
    path = next((path for path in files if path.name == name), None)
    if path is None:
        raise BadRecording(f"The archive has no file '{name}', {what}", "Add it under this name")
    return files.pop(path)


def _sources(members: dict[str, bytes], mapping: ChannelMap) -> Iterator[Source]:
    for name in sorted(members):
        yield open_source(name, io.BytesIO(members[name]), mapping.csv)
