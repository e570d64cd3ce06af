"""`calibrate`: fit the uncertain parameters of a bench and their scatter from run to run (section II.C)."""

import argparse
from pathlib import Path

from slipstick.bench import Bench
from slipstick.errors import InvalidValue
from slipstick.interface.calibrate import calibrate
from slipstick.interface.progress import ProgressLine
from slipstick.machine import Machine, Runs
from slipstick.report.machine_study import tabulate_parameters

from .bench_option import add_bench_or_machine_argument, open_recordings
from .executors import add_dask_argument, cluster_at, refuse_dask
from .orders import add_time_budget_argument
from .program import command_line
from .study_text import plain_table

_MEASURED = Path("tables/measured.h5")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--recordings", type=Path, metavar="FILE",
                        help="recordings with at least one signal, .h5 or .csv, or the name of shipped ones (default: "
                             "tables/measured.h5 where it exists, otherwise sample)")
    parser.add_argument("--signals", type=Path, metavar="FILE",
                        help="the CSV file of the signals, if the recordings are a CSV file")
    add_bench_or_machine_argument(parser)
    parser.add_argument("--model", type=Path, metavar="SPEC.json",
                        help="the model to start from (default: the nominal parameters)")
    add_time_budget_argument(parser)
    add_dask_argument(parser, "compute with many runs of a declared machine")
    parser.add_argument("--out", type=Path, metavar="FILE",
                        help="write the calibration as JSON, for `build --model`")


def run(arguments: argparse.Namespace) -> int:
    """Calibrate, print the result, and write it unless a parameter is at a bound."""
    if arguments.machine is not None:
        return _calibrate_machine(arguments)
    refuse_dask(arguments)
    bench = Bench.open(arguments.bench)
    path = arguments.recordings or (_MEASURED if _MEASURED.is_file() else Path("sample"))
    recordings = open_recordings(bench, path, arguments.signals)
    with ProgressLine(log=True) as line:
        result = calibrate(bench, recordings, model=arguments.model, budget=arguments.time_budget,
                           progress=line.step)
    print(result.text)
    result.calibration.require_inside()
    if arguments.out:
        result.save(arguments.out)
        print(f"Wrote {arguments.out}\nBuild a table of the calibrated model: "
              + command_line("build", "--bench", arguments.bench, "--model", arguments.out,
                             "--out", "tables/calibrated.h5"))
    return 0


def _calibrate_machine(arguments: argparse.Namespace) -> int:
    """Print the parameters of a declared machine that its runs ask for, and write them on request."""
    if arguments.recordings is None or arguments.model is not None or arguments.signals is not None:
        raise InvalidValue("A declared machine is calibrated to the runs of a file",
                           "Give --recordings RUNS.h5, without --model and --signals")
    with cluster_at(arguments.dask) as executor, ProgressLine(log=True) as line:
        result = calibrate(Machine.open(arguments.machine), Runs.open(arguments.recordings),
                           budget=arguments.time_budget, progress=line.step, executor=executor)
    print("\n".join(result.summary()))
    table = tabulate_parameters(result.parameters)
    print(plain_table(table.head, table.rows, table.words))
    if arguments.out:
        print(f"Wrote {result.save(arguments.out)}")
    return 0
