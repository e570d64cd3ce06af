"""`surrogate`: train a neural-network table over any number of parameters on simulations at random points."""

import argparse
from pathlib import Path

from slipstick.black_box import BlackBox
from slipstick.building.surrogates import RUNS, SEED, STEPS
from slipstick.interface.progress import ProgressLine
from slipstick.interface.surrogate import surrogate
from slipstick.table import Surrogate

from .build import add_model_arguments, open_machine, read_axes, verification
from .executors import cluster_at


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--axis", action="append", metavar="NAME=LOW:HIGH",
                        help="an axis of the table: a parameter, and the lowest and highest multiple of its value in "
                             "the model; repeat the option for each axis (default with --machine: all inputs)")
    parser.add_argument("--runs", type=int, default=RUNS, metavar="N",
                        help="number of training points to simulate (default: %(default)s)")
    parser.add_argument("--steps", type=int, default=STEPS, metavar="N",
                        help="number of training steps; 50,000 take about a minute (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=SEED,
                        help="seed of the points and of the training (default: %(default)s)")
    add_model_arguments(parser, Path("tables/surrogate.h5"))


def run(arguments: argparse.Namespace) -> int:
    """Train the surrogate, write it, and print its error."""
    axes, simulated = read_axes(arguments.axis, "NAME=LOW:HIGH"), open_machine(arguments)
    file = simulated["machine"] if isinstance(simulated["machine"], BlackBox) else None
    with cluster_at(arguments.dask, file) as executor:
        trained = surrogate(**simulated, axes=axes, out=arguments.out, runs=arguments.runs, steps=arguments.steps,
                            seed=arguments.seed, accuracy=arguments.accuracy, threads=arguments.threads,
                            executor=executor, progress=ProgressLine(log=True))
    print(f"Wrote {arguments.out}: surrogate {describe_error(trained)}; digest {trained.digest}\n"
          f"{verification(arguments)}")
    return 0


def describe_error(surrogate: Surrogate) -> str:
    """The size of the surrogate and its stated error as text."""
    error, unit = surrogate.error, surrogate.output.unit

    def spelled(value: float) -> str:
        return f"{1e3 * value:.4f} ms" if unit == "s" else f"{value:.4g} {unit}"

    return (f"over {len(surrogate.axes)} axes from {surrogate.runs:,} runs; error at {error.points:,} held-out points: "
            f"{spelled(error.overall_rms)} RMS, {spelled(error.rms.max())} RMS in the worst condition, "
            f"{spelled(error.worst.max())} maximum")
