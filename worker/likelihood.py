"""`likelihood`: how likely measured outputs are under distributions of the inputs of a table."""

import argparse
from pathlib import Path
from typing import get_args

from slipstick.bench import Bench
from slipstick.black_box import BlackBoxDescription, Measurements
from slipstick.inference.likelihoods import Method
from slipstick.inference.problems import Measured
from slipstick.interface.likelihood import likelihood
from slipstick.table import Table

from .bench_option import add_bench_argument, open_recordings
from .propagate import add_inputs_arguments, read_inputs, read_quantity, require_output, write_output


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("table", type=Path, metavar="TABLE.h5", help="the table, a grid or a surrogate")
    parser.add_argument("recordings", type=Path, metavar="RECORDINGS",
                        help="measured shifting times, or outputs of the machine of the table, .h5 or .csv")
    add_inputs_arguments(parser)
    parser.add_argument("--output-std", required=True, metavar="VALUE",
                        help='standard deviation of the output noise, such as "10 ms", or a number in the unit of the '
                             "output")
    parser.add_argument("--method", choices=get_args(Method), default="auto",
                        help="how the density is integrated over the inputs (docs/uncertainty.md; "
                             "default: %(default)s)")
    add_bench_argument(parser)
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the result as .json, or as .csv with a row for "
                                                                 "each measurement")


def run(arguments: argparse.Namespace) -> int:
    """Compute the likelihood, print it, and write the requested file."""
    require_output(arguments.out)
    table = Table.open(arguments.table)
    recordings = open_measured(table, arguments)
    result = likelihood(arguments.table, recordings, **read_inputs(arguments), name=arguments.recordings.stem,
                        method=arguments.method,
                        output_std=read_quantity("--output-std", arguments.output_std, table.output.unit))
    print(result)
    written = write_output(result, arguments.out)
    if written:
        print(f"\nWrote {written[0]}")
    return 0


def open_measured(table: Table, arguments: argparse.Namespace) -> Measured:
    """The recordings of the bench, or for a table of another machine its measurements; raises `BadRecording`."""
    path: Path = arguments.recordings
    if isinstance(table.model, BlackBoxDescription):
        if path.suffix == ".csv":
            return Measurements.read_csv(path.read_bytes(), table.model)
        return Measurements.read(path)
    return open_recordings(Bench.open(arguments.bench), path)
