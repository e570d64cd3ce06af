"""`likelihood`: how likely measured outputs are under distributions of the inputs of a table."""

import argparse
import sys
from pathlib import Path
from typing import get_args

from slipstick.black_box import BlackBox, BlackBoxDescription, Measurements, measure_runs
from slipstick.errors import InvalidValue
from slipstick.inference.likelihoods import Method
from slipstick.inference.problems import Measured
from slipstick.interface.likelihood import likelihood
from slipstick.machine import holds_runs, read_runs
from slipstick.table import Table
from slipstick.table.subject import Subject

from .bench_option import add_bench_argument, open_bench, open_recordings, refuse_machine
from .propagate import add_inputs_arguments, read_inputs, read_quantity, require_output, write_output


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("table", type=Path, metavar="TABLE.h5", help="the table, a grid or a surrogate")
    parser.add_argument("recordings", type=Path, metavar="RECORDINGS",
                        help="measured shifting times, or outputs of the machine of the table, .h5 or .csv; with "
                             "--machine also its recorded runs")
    add_machine_argument(parser)
    add_inputs_arguments(parser)
    parser.add_argument("--output-std", required=True, metavar="VALUE",
                        help='standard deviation of the output noise, such as "10 ms", or a number in the unit of the '
                             "output")
    parser.add_argument("--method", choices=get_args(Method), default="auto",
                        help="how the density is integrated over the inputs (docs/uncertainty.md; "
                             "default: %(default)s)")
    add_bench_argument(parser, default=None)
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the result as .json, or as .csv with a row for "
                                                                 "each measurement")


def run(arguments: argparse.Namespace) -> int:
    """Compute the likelihood, print it, and write the requested file."""
    require_output(arguments.out)
    table = Table.open(arguments.table)
    recordings = open_measured(table.model, arguments)
    result = likelihood(arguments.table, recordings, **read_inputs(arguments), name=arguments.recordings.stem,
                        method=arguments.method,
                        output_std=read_quantity("--output-std", arguments.output_std, table.output.unit))
    print(result)
    written = write_output(result, arguments.out)
    if written:
        print(f"\nWrote {written[0]}")
    return 0


def add_machine_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option `--machine`."""
    parser.add_argument("--machine", type=Path, metavar="FILE",
                        help="the Python file that declares the machine of recorded runs (docs/any_machine.md)")


def open_measured(model: Subject, arguments: argparse.Namespace) -> Measured:
    """The recordings of the bench, or the measurements or recorded runs of another machine.

    Raises `BadRecording`, and `InvalidValue` for a bench or a machine that the model is not of.
    """
    path: Path = arguments.recordings
    if not isinstance(model, BlackBoxDescription):
        refuse_machine(arguments)
        return open_recordings(open_bench(arguments), path)
    if arguments.bench is not None:
        raise InvalidValue(f"--bench is a clutch, and what is simulated is another machine, {model.title}",
                           "Leave it out")
    if not holds_runs(path):
        return Measurements.open(path, model)
    if arguments.machine is None:
        raise InvalidValue(f"'{path.name}' holds recorded runs, from whose signals the output is computed",
                           "Give the file that declares the machine as --machine FILE")
    measured = measure_runs(read_runs(path), BlackBox.open(arguments.machine, model.output.name))
    if measured.description:
        print(measured.description, file=sys.stderr)
    return measured
