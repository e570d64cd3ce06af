"""Uploaded files with their mapping, as a ZIP archive, imported in a limited child process."""

import io
import json
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np

from slipstick.acquisition.channel import Source
from slipstick.acquisition.importing import import_sources
from slipstick.acquisition.machine_import import import_runs
from slipstick.acquisition.machine_mapping import read_machine_mapping
from slipstick.acquisition.mapping import FileMap
from slipstick.acquisition.mapping_file import read_mapping
from slipstick.acquisition.opening import FORMATS, is_hidden, is_measurement, open_source
from slipstick.acquisition.result import ImportedFiles, LeadIn, SetAside
from slipstick.acquisition.subject import Subject, name_subject, open_subject
from slipstick.bench import Bench
from slipstick.errors import BadRecording
from slipstick.machine import channels_of, write_runs
from slipstick.storage.isolated import isolated

MAPPING = "channels.toml"
"""Name of the mapping in an archive."""

_MOST_FILES, _MOST_BYTES = 5000, 1 << 30
_SECONDS = 120  # of processor time
_FAILED = "The import of the archive crashes, or needs more than two minutes or 4 GB"


@dataclass(frozen=True)
class ImportReport:
    """What must be known about imported recordings or runs; see `Imported`.

    `computed` and `led_in` are None for runs of a machine, and `led_in` where nobody asks for it.
    """

    labels: tuple[str, ...]
    computed: bool | None
    led_in: LeadIn | None
    set_aside: tuple[SetAside, ...]
    remarks: tuple[str, ...]
    doubts: tuple[str, ...]
    open_questions: tuple[str, ...]


def import_archive(content: bytes, subject: Subject, leads_in: bool = False) -> tuple[bytes, ImportReport]:
    """Recordings as HDF5, and what must be known about them, of the bytes of an archive with files of a bench.

    Those of a machine are runs. With `leads_in`, the report of a bench has what precedes the first shift commands.
    The archive has the mapping as `channels.toml`, the files, and the sheet of conditions if the mapping names one;
    folders are ignored. Everything is read in a limited child process. Raises `BadRecording`.
    """
    request = name_subject(subject, leads_in=leads_in) + content
    answer = isolated(request, "slipstick.acquisition.archive:answer", BadRecording, _SECONDS, _FAILED)
    said, _, recordings = answer.partition(b"\n")
    report = json.loads(said)
    aside = tuple(SetAside(entry["label"], entry["reason"]) for entry in report["set_aside"])
    lead = report["led_in"] and LeadIn(np.array(report["led_in"]["time"]), {
        name: np.array(values) for name, values in report["led_in"]["signals"].items()})
    return recordings, ImportReport(tuple(report["labels"]), report["computed"], lead, aside, *(
        tuple(report[name]) for name in ("remarks", "doubts", "open_questions")))


def answer(request: bytes) -> bytes:
    """In the child process: a line with the report as JSON, and the recordings as HDF5."""
    said, _, content = request.partition(b"\n")
    subject, files = open_subject(said), _files(content)
    text = _take_file(files, MAPPING, "the mapping")
    if isinstance(subject, Bench):
        mapping = read_mapping(text, MAPPING)
        given = _take_measurements(files, mapping)
        imported = import_sources(given.sources, mapping, subject, given.plan)
        lead = imported.led_in if json.loads(said)["leads_in"] else None
        return _report(imported, given, imported.computed, lead) + imported.recordings.to_bytes()
    machine = channels_of(subject)
    machine_mapping = read_machine_mapping(text, MAPPING, machine)
    given = _take_measurements(files, machine_mapping)
    cut = import_runs(given.sources, machine_mapping, machine, given.plan, subject.ranges)
    return _report(cut, given, None, None) + write_runs(cut.runs, machine)


@dataclass(frozen=True, eq=False)
class _Given:
    """What an archive has beside the mapping: measurements, the sheet of conditions, and names of other files."""

    sources: Iterator[Source]
    plan: bytes | None
    left_out: list[str]


def _take_measurements(files: dict[PurePosixPath, bytes], mapping: FileMap) -> _Given:
    plan = None if mapping.plan is None else _take_file(files, mapping.plan, "the sheet of conditions")
    runs = {path.name: read for path, read in files.items() if is_measurement(path)}
    if not runs:
        raise BadRecording("The archive has no file of a known kind beside the mapping",
                           f"Known are names in {', '.join(FORMATS)}")
    return _Given(_sources(runs, mapping), plan, [path.as_posix() for path in files if not is_measurement(path)])


def _report(imported: ImportedFiles, given: _Given, computed: bool | None, lead: LeadIn | None) -> bytes:
    left_out = [f"left out of the archive, because of their names: {', '.join(given.left_out[:10])}"
                for _ in given.left_out[:1]]
    led_in = lead and {"time": lead.time.tolist(),
                       "signals": {name: values.tolist() for name, values in lead.signals.items()}}
    return json.dumps({
        "labels": imported.labels, "computed": computed, "led_in": led_in,
        "set_aside": [{"label": entry.label, "reason": entry.reason} for entry in imported.set_aside],
        "remarks": [*imported.remarks, *left_out], "doubts": imported.doubts,
        "open_questions": imported.open_questions}).encode() + b"\n"


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


def _sources(members: dict[str, bytes], mapping: FileMap) -> Iterator[Source]:
    for name in sorted(members):
        yield open_source(name, io.BytesIO(members[name]), mapping.csv)
