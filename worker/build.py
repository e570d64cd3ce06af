"""`build`: simulate a table of shifting times on a grid of any model parameters."""

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from slipstick.bench import Bench
from slipstick.bench.conditions import Conditions
from slipstick.black_box import BlackBox
from slipstick.black_box.simulation import OUTCOMES
from slipstick.building.axes import Spans
from slipstick.clutch.ensemble import STATUS as LOCKING
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.interface.build import ACCURACIES, PAPER_AXES, build
from slipstick.interface.progress import ProgressLine
from slipstick.interruption import STATUS

from .bench_option import add_bench_argument, add_simulated_arguments, open_simulated
from .executors import add_dask_argument, cluster_at
from .program import command_line


class Simulated(TypedDict):
    """What is simulated, with the names of the parameters of `slipstick.build`."""

    machine: Bench | BlackBox
    model: Model | None
    conditions: Conditions | None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    usual = " and ".join(f"{name}={':'.join(map(str, span))}" for name, span in PAPER_AXES.items())
    parser.add_argument("--axis", action="append", metavar="NAME=LOW:HIGH:COUNT",
                        help="an axis of the table: a parameter, the lowest and highest multiple of its value in the "
                             "model, and the number of equidistant grid points; repeat the option for each axis "
                             f"(default: {usual}; with --machine all inputs)")
    add_model_arguments(parser, Path("tables/nominal.h5"))


def add_model_arguments(parser: argparse.ArgumentParser, out: Path) -> None:
    """Add the options that all tables share: model, conditions, output file (default `out`), threads and accuracy."""
    either = parser.add_mutually_exclusive_group()
    add_bench_argument(either)
    either.add_argument("--machine", type=Path, metavar="FILE",
                        help="simulate another machine than the clutch of a bench: a TOML file with its inputs, "
                             "conditions, output and simulator (a Python callable, an FMU or an UM-Bridge model), or "
                             "the Python file that declares it (docs/any_machine.md)")
    add_simulated_arguments(parser)
    parser.add_argument("--output", metavar="NAME",
                        help="the output of a declared machine (default: the first that it declares)")
    parser.add_argument("--out", type=Path, default=out, metavar="FILE",
                        help="the table file to write (default: %(default)s)")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1, metavar="N",
                        help="number of simulation threads, or of processes for a Python callable "
                             "and for a declared machine (default: %(default)s, one per core; not used with --dask)")
    add_dask_argument(parser)
    parser.add_argument("--accuracy", choices=ACCURACIES, default="default",
                        help="accuracy of the time integration of a clutch; at nominal parameters, shifting times of "
                             "`default` differ from those of `tight` by at most 1e-4 s")


def open_machine(arguments: argparse.Namespace) -> Simulated:
    """What the options `--machine`, `--bench`, `--model` and `--conditions` say; raises `InvalidValue`."""
    if arguments.machine is None:
        if arguments.output is not None:
            raise InvalidValue("--output is given without --machine", "Name the file that declares the machine")
        bench, model, conditions = open_simulated(arguments)
        return {"machine": bench, "model": model, "conditions": conditions}
    given = {"model": arguments.model, "conditions": arguments.conditions, "accuracy": arguments.accuracy != "default"}
    for option, is_given in given.items():
        if is_given:
            raise InvalidValue(f"--{option} and --machine exclude each other",
                               "The file of the machine describes its simulator and its conditions")
    return {"machine": BlackBox.open(arguments.machine, arguments.output), "model": None, "conditions": None}


def read_axes(texts: Sequence[str] | None, form: str) -> Spans | None:
    """Axes from texts of the `form` NAME=LOW:HIGH or NAME=LOW:HIGH:COUNT, None without any; raises `InvalidValue`."""
    axes: dict[str, Sequence[float]] = {}
    for text in texts or ():
        name, _, span = text.partition("=")
        try:
            low, high, *count = span.split(":")
            if len(count) != form.count(":") - 1:
                raise ValueError
            values = float(low), float(high), *map(int, count)
        except ValueError as error:
            raise InvalidValue(f"'{text}' is not a valid axis",
                               f"Write {form}, such as pressure_bias=0.8:1.2{':25' * ('COUNT' in form)}") from error
        if name in axes:
            raise InvalidValue(f"The parameter {name} has more than one axis", "Give each parameter one --axis")
        axes[name] = values
    return axes or None


def run(arguments: argparse.Namespace) -> int:
    """Build the table and print its size, its statuses and its digest."""
    axes, simulated = read_axes(arguments.axis, "NAME=LOW:HIGH:COUNT"), open_machine(arguments)
    file = simulated["machine"] if isinstance(simulated["machine"], BlackBox) else None
    try:
        with cluster_at(arguments.dask, file) as executor:
            table = build(**simulated, axes=axes, out=arguments.out, accuracy=arguments.accuracy,
                          threads=arguments.threads, executor=executor, progress=ProgressLine(log=True))
    except KeyboardInterrupt:  # the function has said what to do
        return STATUS
    outcomes, items = (LOCKING, "engagements") if file is None else (OUTCOMES, "runs")
    counts = ", ".join(f"{np.count_nonzero(table.status == code):,} {name}" for code, name in outcomes.items())
    print(f"Wrote {arguments.out}: {' x '.join(map(str, table.times.shape))} {items} ({counts}), "
          f"digest {table.digest}\n{verification(arguments)}")
    return 0


def verification(arguments: argparse.Namespace) -> str:
    """How to compare the table that was written with direct simulation."""
    machine: list[Any] = ["--machine", arguments.machine] if arguments.machine else []
    return f"Compare it with direct simulation: {command_line('verify', arguments.out, *machine)}"
