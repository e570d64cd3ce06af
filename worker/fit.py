"""`fit`: mean and scatter of parameters, fitted to measured shifting times on a table, or by direct simulation."""

import argparse
import json
from pathlib import Path
from typing import Any

from slipstick.bench import Bench
from slipstick.black_box import BlackBox
from slipstick.errors import InvalidValue
from slipstick.interface.files import require_html, require_suffix
from slipstick.interface.fit import fit
from slipstick.interface.progress import ProgressLine
from slipstick.table import Table

from .bench_option import add_bench_argument, open_bench, open_recordings
from .likelihood import add_machine_argument, open_measured
from .orders import add_time_budget_argument


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("table", type=Path, metavar="TABLE.h5", nargs="?",
                        help="the table; without one, the machine or the model of the bench is simulated")
    parser.add_argument("recordings", type=Path, metavar="RECORDINGS",
                        help="measured shifting times, or outputs of the machine, .h5 or .csv; with --machine also its "
                             "recorded runs")
    parser.add_argument("--parameter", action="append", metavar="NAME", dest="parameters",
                        help="an uncertain input; repeat the option for several (default: all axes of the table)")
    add_machine_argument(parser)
    parser.add_argument("--output", metavar="NAME",
                        help="without a table, the output of the declared machine (default: its first)")
    add_bench_argument(parser, default=None)
    parser.add_argument("--model", type=Path, metavar="SPEC.json",
                        help="the model to simulate without a table (default: the nominal parameters of the bench)")
    parser.add_argument("--outside", choices=("clip", "nan", "error"), default="clip",
                        help="what holds outside the table (default: %(default)s)")
    parser.add_argument("--settings", type=Path, metavar="FILE.json",
                        help='JSON file with the settings to change, such as {"families": ["gamma"]} '
                             "(docs/uncertainty.md)")
    add_time_budget_argument(parser)
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="write the result as JSON")
    parser.add_argument("--report", type=Path, metavar="FILE.html", help="write the report, one HTML page with figures")


def run(arguments: argparse.Namespace) -> int:
    """Fit, print the result, and write the requested files."""
    if arguments.out is not None:
        require_suffix(arguments.out, ".json")
    if arguments.report is not None:
        require_html(arguments.report)
    if arguments.output is not None and (arguments.table is not None or arguments.machine is None):
        raise InvalidValue("--output chooses an output of a machine that is simulated; a table has one, and a bench "
                           "the shifting time", "Leave it out, or give --machine without a table")
    simulator: Table | BlackBox | Bench
    if arguments.table is not None:
        simulator = Table.open(arguments.table)
        recordings = open_measured(simulator.model, arguments)
    elif arguments.machine is not None:
        simulator = BlackBox.open(arguments.machine, arguments.output)
        recordings = open_measured(simulator.description, arguments)
    else:
        simulator = open_bench(arguments)
        recordings = open_recordings(simulator, arguments.recordings)
    with ProgressLine(log=True) as line:
        result = fit(simulator, recordings, arguments.parameters,
                     model=arguments.model, outside=arguments.outside,
                     budget=arguments.time_budget, progress=line.step, name=arguments.recordings.stem,
                     **read_settings(arguments.settings))
    print(result)
    written = [result.save(arguments.out)] if arguments.out else []
    if arguments.report:
        written.append(result.report(arguments.report))
    if written:
        print(f"\nWrote {', '.join(map(str, written))}")
    return 0


def read_settings(path: Path | None) -> dict[str, Any]:
    """The settings in a JSON file, none without one; raises `InvalidValue`."""
    if path is None:
        return {}
    try:
        return dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError) as error:
        raise InvalidValue(f"Cannot read the settings of a fit from '{path}' ({type(error).__name__}: {error})",
                           'Give a JSON object, such as {"families": ["gamma"], "seed": 2}') from error
