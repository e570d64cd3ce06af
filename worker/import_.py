"""`import`: recordings from the files of a data-acquisition system, by a mapping of their channels."""

import argparse
import sys
from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path, PurePath
from typing import TypeVar

from slipstick.acquisition import (
    import_runs,
    import_sources,
    open_machine_mapping,
    open_mapping,
    open_source,
    propose,
    propose_for_machine,
)
from slipstick.acquisition.channel import Source
from slipstick.acquisition.comparison import compare
from slipstick.acquisition.csv_layout import CsvOptions
from slipstick.acquisition.guess import Proposal
from slipstick.acquisition.mapping import FileMap
from slipstick.acquisition.opening import FORMATS, is_measurement
from slipstick.acquisition.result import ImportedFiles
from slipstick.bench import Bench
from slipstick.black_box.ranges import simulate_ranges
from slipstick.errors import BadRecording, InvalidValue
from slipstick.interface.files import require_suffix, write
from slipstick.interface.progress import ProgressLine
from slipstick.machine import Machine, open_machine, write_runs
from slipstick.numerics.quantities import raised
from slipstick.report.imported import imported_page, imported_runs_page, summary
from slipstick.report.study.words import many

from .bench import write_template
from .bench_option import add_bench_or_machine_argument

PLAN = "plan.csv"
"""What a sheet of conditions is called where no mapping names it."""
_MOST_REMARKS = 20
Result = TypeVar("Result", bound=ImportedFiles)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("files", type=Path, nargs="+", metavar="FILES",
                        help="files of the bench or machine (MDF, MATLAB, CSV, Parquet), or folders of them")
    parser.add_argument("--map", type=Path, metavar="FILE.toml",
                        help="the mapping of the channels; with --guess, the file to write it to")
    parser.add_argument("--out", type=Path, metavar="FILE.h5", help="write the recordings or runs as HDF5")
    parser.add_argument("--page", type=Path, metavar="FILE.html",
                        help="write the page of what was understood (default: beside --out)")
    parser.add_argument("--guess", action="store_true",
                        help="propose a mapping from names and units of the first file, and say what was guessed")
    add_bench_or_machine_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Import, or propose a mapping."""
    if arguments.machine is None:
        return _import_bench(arguments, Bench.open(arguments.bench))
    return _import_machine(arguments, open_machine(arguments.machine))


def _import_bench(arguments: argparse.Namespace, bench: Bench) -> int:
    if arguments.guess:
        return _guess(arguments, lambda source: propose(source, bench))
    page = _require_paths(arguments)
    mapping = open_mapping(arguments.map)
    files = _list_mapped(arguments, mapping)
    imported = _read(files, arguments.map, mapping, lambda sources, plan, progress: import_sources(
        sources, mapping, bench, plan, progress))
    imported.recordings.save(arguments.out)
    if imported.recordings.signals is not None:
        print("simulating one engagement for the page", file=sys.stderr)
    return _write(page, imported_page(arguments.out.stem, imported, bench, compare(imported.recordings, bench)),
                  arguments.out, imported)


def _import_machine(arguments: argparse.Namespace, machine: Machine) -> int:
    if arguments.guess:
        return _guess(arguments, lambda source: propose_for_machine(source, machine))
    page = _require_paths(arguments)
    mapping = open_machine_mapping(arguments.map, machine)
    files, ranges = _list_mapped(arguments, mapping), simulate_ranges(machine)
    imported = _read(files, arguments.map, mapping, lambda sources, plan, progress: import_runs(
        sources, mapping, machine, plan, ranges, progress))
    write(arguments.out, write_runs(imported.runs, machine))
    return _write(page, imported_runs_page(arguments.out.stem, imported), arguments.out, imported)


def _require_paths(arguments: argparse.Namespace) -> Path:
    """The path of the page; raises `InvalidValue` for paths that are missing or no files of their kind."""
    if arguments.map is None or arguments.out is None:
        raise InvalidValue("--map or --out is missing",
                           "Give both; `import FILES --guess --map channels.toml` proposes a mapping")
    page: Path = arguments.page or arguments.out.with_suffix(".html")
    require_suffix(arguments.out, ".h5")
    require_suffix(page, ".html")
    return page


def _read(files: Sequence[Path], beside: Path, mapping: FileMap,
          importer: Callable[[Iterator[Source], bytes | None, Callable[[str], None]], Result]) -> Result:
    """What an importer makes of files by their mapping; the sheet of conditions is `beside` it."""
    plan = None if mapping.plan is None else _plan(beside, mapping.plan)
    with ProgressLine(log=True) as line:
        done = iter(range(len(files) + 1))
        line.count(next(done), len(files), "files")
        return importer(_sources(files, mapping), plan, lambda name: line.count(next(done), len(files), "files"))


def _write(page: Path, text: str, out: Path, imported: ImportedFiles) -> int:
    write(page, text.encode())
    print(report(imported))  # when all is written: whoever reads it may stop after a line, which ends the command
    print(f"Wrote {out} and {page}: look at the pictures before you go on")
    return 0


def report(imported: ImportedFiles) -> str:
    """The import as plain text."""
    lines = [f"{many(len(imported.labels), imported.experiment)} imported, {len(imported.set_aside)} set aside. "
             f"{summary(imported)}"]
    lines += [f"  {channel.name} <- {'-' if channel.sign < 0 else ''}{channel.channel} "
              f"[{channel.stated or 'unit not stated'}], {channel.lowest:.4g} to {channel.highest:.4g} "
              f"{raised(channel.unit)}"
              for channel in imported.channels]
    set_aside = [f"{exclusion.label}: {exclusion.reason}" for exclusion in imported.set_aside]
    for title, entries in (("Set aside", set_aside),
                           ("Not determined", imported.open_questions), ("Detected or assumed", imported.remarks),
                           ("Looks wrong", imported.doubts)):
        if entries:
            lines += [f"{title}:", *(f"  {entry}" for entry in entries[:_MOST_REMARKS])]
            if len(entries) > _MOST_REMARKS:
                lines.append(f"  and {len(entries) - _MOST_REMARKS} more, on the page")
    return "\n".join(lines)


def _list_mapped(arguments: argparse.Namespace, mapping: FileMap) -> list[Path]:
    """The files that a mapping is for: all that are given, but for its sheet of conditions in a folder of them."""
    return _files(arguments.files, set() if mapping.plan is None else {(arguments.map.parent / mapping.plan).resolve()})


def _files(given: Sequence[Path], sheets: Collection[Path]) -> list[Path]:
    """The files, and those of folders but for `sheets`, sorted by name; raises `BadRecording` where one is missing."""
    measured: list[Path] = []
    for path in given:
        if path.is_dir():
            inside = sorted(file for file in path.iterdir() if is_measurement(PurePath(file.name))
                            and file.resolve() not in sheets)
            if not inside:
                raise BadRecording(f"The folder '{path}' has no file of a known kind",
                                   f"Known are {', '.join(FORMATS)}; name files of other names one by one")
            measured += inside
        elif path.is_file():
            measured.append(path)
        else:
            raise BadRecording(f"There is no file '{path}'", "Check the name")
    names = [path.name for path in measured]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise BadRecording(f"Two files are called '{twice}'", "Give each file a name of its own")
    return measured


def _sources(files: Sequence[Path], mapping: FileMap) -> Iterator[Source]:
    for path in files:
        with path.open("rb") as file:
            yield open_source(path.name, file, mapping.csv)


def _plan(beside: Path, name: str) -> bytes:
    path = beside.parent / name
    if not path.is_file():
        raise BadRecording(f"There is no file '{path}', the sheet of conditions", "Put it beside the mapping")
    return path.read_bytes()


def _guess(arguments: argparse.Namespace, proposer: Callable[[Source], Proposal]) -> int:
    path, *_ = _files(arguments.files, {(folder / PLAN).resolve() for folder in arguments.files})
    out: Path | None = arguments.map
    with path.open("rb") as file:
        proposal = proposer(open_source(path.name, file, CsvOptions()))
    if out is None:
        print(proposal.text, end="")
    else:
        write_template(out, proposal.text.encode())
    to = sys.stderr if out is None else sys.stdout
    for guess in proposal.guesses:
        print(f"{guess.name}: {'open, ' if guess.channel is None else ''}{guess.reason}", file=to)
    if out is not None:
        print(f"Wrote {out}. Check every GUESS; to be filled in: {', '.join(proposal.open_keys)}")
    return 0
