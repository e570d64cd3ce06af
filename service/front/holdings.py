"""The files of the front page: benches, tables and recordings; an invalid one with the reason."""

from collections.abc import Sequence

from slipstick.bench import Bench
from slipstick.black_box import Measurements
from slipstick.errors import SlipstickError
from slipstick.machine import Runs
from slipstick.numerics.quantities import raised
from slipstick.pictures import units
from slipstick.pictures.theme import in_words
from slipstick.recordings import Recordings
from slipstick.report.words import listed
from slipstick.storage.library import Library
from slipstick.table import Axis, Surrogate, Table

from ..front.elements import UNFOLDED, Entry, group, listings, plural
from .file_actions import Folder


def holdings(library: Library, machines: Sequence[Entry]) -> str:
    """Return the sections of the files, and of `machines`, as HTML."""
    return "\n".join([
        group("Tables", [file_entry("tables", name, library) for name in library.tables()],
              "There is no table yet.", *listings("/v1/tables"), most=UNFOLDED),
        group("Recordings", [file_entry("recordings", name, library) for name in library.recordings()],
              "There are no recordings yet.", *listings("/v1/recordings"), most=UNFOLDED),
        group("Benches", [file_entry("benches", name, library) for name in library.benches()],
              "There is no bench yet.", *listings("/v1/benches"), most=UNFOLDED),
        group("Machines", machines, "", *listings("/v1/machines"), most=UNFOLDED)])


def file_entry(folder: Folder, name: str, library: Library) -> Entry:
    """Return a file as an entry of a list."""
    try:
        return Entry(name, f"/{folder}/{name}", about(folder, name, library))
    except SlipstickError as error:
        return Entry(name, f"/{folder}/{name}", str(error), "invalid")


def about(folder: Folder, name: str, library: Library) -> str:
    """Return what a file holds, in a sentence."""
    match folder:
        case "tables":
            return library.derive_from_table(name, _describe_table)
        case "recordings":
            return library.derive_from_recorded(name, _describe_recordings)
        case "benches":
            return library.derive_from_bench(name, _describe_bench)


def _describe_table(table: Table) -> str:
    axes = listed([f"{in_words(axis.name)} ({_range(axis)})" for axis in table.axes])
    if isinstance(table, Surrogate):
        kind = f"Surrogate (held-out RMS error {1e3 * table.error.overall_rms:.3g} m{table.output.unit})"
    else:
        shape = " × ".join(str(len(axis.values)) for axis in table.axes)
        kind = f"Grid of {shape} points"
    return f"{kind} over {axes}, under {plural(len(table.conditions), 'condition')}"


def _range(axis: Axis) -> str:
    lower, upper = axis.nominal * axis.values[0], axis.nominal * axis.values[-1]
    unit, factor = units.scale(axis.unit, max(abs(lower), abs(upper)))
    return units.with_unit(f"{units.number(factor * lower)} to {units.number(factor * upper)}", unit)


def _describe_recordings(recordings: Recordings | Measurements | Runs) -> str:
    if isinstance(recordings, Runs):
        description = f". {recordings.description}" if recordings.description else ""
        return f"{plural(len(recordings), 'run')} of the machine “{recordings.machine}”{description}"
    if isinstance(recordings, Measurements):
        output = recordings.output
        return f"{plural(len(recordings), 'measurement')} of {in_words(output.name)} in {raised(output.unit)}"
    signals = "without signals" if recordings.signals is None else "with signals"
    description = f". {recordings.description}" if recordings.description else ""
    return f"{plural(len(recordings), 'engagement')} {signals}{description}"


def _describe_bench(bench: Bench) -> str:
    return f"{bench.title}, {plural(len(bench.conditions), 'condition')}"
