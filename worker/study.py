"""`study`: find, name, add and show the physical effect that recordings show and the model lacks."""

import argparse
import json
from pathlib import Path
from typing import Any

from slipstick.bench import Bench
from slipstick.errors import InvalidValue
from slipstick.interface.files import require_html, require_suffix, write
from slipstick.interface.progress import ProgressLine
from slipstick.interface.study import study
from slipstick.machine import Machine, Runs
from slipstick.studies import StudySettings
from slipstick.time_budget import TimeBudgetEnded

from .bench_option import add_bench_or_machine_argument, open_recordings, refuse_bench_options
from .executors import add_dask_argument, cluster_at, refuse_dask
from .orders import add_time_budget_argument
from .program import command_line
from .study_text import machine_study_text, study_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("recordings", type=Path, metavar="RECORDINGS", help="recordings with signals, .h5 or .csv")
    parser.add_argument("--signals", type=Path, metavar="FILE",
                        help="the CSV file of the signals, if RECORDINGS is a CSV file")
    add_bench_or_machine_argument(parser)
    parser.add_argument("--settings", type=Path, metavar="FILE.json",
                        help='JSON file with the study settings to change, such as {"level": 0.95}')
    add_time_budget_argument(parser)
    add_dask_argument(parser, "compute with many runs of a declared machine")
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="write the result as JSON")
    parser.add_argument("--report", type=Path, metavar="FILE.html", help="write the report, one HTML page with figures")
    parser.add_argument("--extended", type=Path, metavar="FILE.json",
                        help="write the model extended by what was found, for `build --model`")
    parser.add_argument("--laws", type=Path, metavar="DIR",
                        help="write each measured law into this folder, as CSV, MATLAB, Modelica and C files")


def run(arguments: argparse.Namespace) -> int:
    """Study the recordings, print the result, and write the requested files."""
    for path in (arguments.out, arguments.extended):
        if path is not None:
            require_suffix(path, ".json")
    if arguments.report is not None:
        require_html(arguments.report)
    if arguments.laws is not None and arguments.laws.exists() and not arguments.laws.is_dir():
        raise InvalidValue(f"'{arguments.laws}' is a file", "Give --laws the name of a folder")
    if arguments.machine is not None:
        return _study_machine(arguments)
    refuse_dask(arguments)
    settings = read_settings(arguments.settings) if arguments.settings else StudySettings()
    bench = Bench.open(arguments.bench)
    recordings = open_recordings(bench, arguments.recordings, arguments.signals)
    with ProgressLine(log=True) as line:
        output = study(bench, recordings, settings=settings, budget=arguments.time_budget, progress=line.step,
                       name=arguments.recordings.stem)
    print(study_text(output.result, output.figures, settings))
    written = []
    if arguments.out:
        written.append(output.save(arguments.out))
    if arguments.report:
        written.append(output.report(arguments.report))
    if arguments.extended and output.result.after:
        written.append(write(arguments.extended, f"{json.dumps(output.result.after.model, indent=1)}\n".encode()))
    if arguments.laws:
        written += output.save_laws(arguments.laws)
    if written:
        print(f"\nWrote {', '.join(map(str, written))}")
    if arguments.extended and not output.result.after:
        raise TimeBudgetEnded.before(arguments.time_budget, "there was an extended model, which was not written")
    if arguments.extended:
        print("Build a table of the extended model: "
              + command_line("build", "--bench", arguments.bench, "--model", arguments.extended,
                             "--conditions", arguments.recordings, "--out", "tables/extended.h5"))
    return 0


def _study_machine(arguments: argparse.Namespace) -> int:
    """Study the runs of a declared machine, and do the same with the result."""
    refuse_bench_options(arguments, signals=None, extended=None)
    settings = read_json(arguments.settings) if arguments.settings else {}
    with cluster_at(arguments.dask) as executor, ProgressLine(log=True) as line:
        output = study(Machine.open(arguments.machine), Runs.open(arguments.recordings), settings=settings,
                       budget=arguments.time_budget, progress=line.step, name=arguments.recordings.stem,
                       executor=executor)
    print(machine_study_text(output.result))
    written = [*([output.save(arguments.out)] if arguments.out else []),
               *([output.report(arguments.report)] if arguments.report else []),
               *(output.save_laws(arguments.laws) if arguments.laws else [])]
    if written:
        print(f"\nWrote {', '.join(map(str, written))}")
    return 0


def read_settings(path: Path) -> StudySettings:
    """Read settings from a JSON file; raises `InvalidValue`, `UnknownName`."""
    try:
        return StudySettings.from_dict(read_json(path))
    except (TypeError, AttributeError) as error:
        raise _unreadable(path, error) from error


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object; raises `InvalidValue`."""
    try:
        return dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError) as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> InvalidValue:
    return InvalidValue(f"Cannot read study settings from '{path}' ({type(error).__name__}: {error})",
                        'Give a JSON object, such as {"level": 0.95, "seed": 2}')
