"""`build`: simulate a table of shifting times on a grid of any model parameters."""

import argparse
import math
import os
import sys
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path

import numpy as np

from slipstick.bench import parameters
from slipstick.bench.conditions import Conditions
from slipstick.black_box.simulation import OUTCOMES, start_executor
from slipstick.clutch.ensemble import DEFAULT, STATUS, TIGHT
from slipstick.clutch.model import Model
from slipstick.errors import BadTable, InvalidValue, WrongLayout
from slipstick.table import Axis, Table

from .bench_option import add_simulated_arguments, open_simulated
from .building import build
from .compiling import compile_simulator
from .executors import add_dask_argument, open_executor
from .machine_plan import MachineRuns, add_machine_argument, machine_axes, open_machine_file
from .plan import GridPlan, Plan
from .progress import Progress

ACCURACIES = {"default": DEFAULT, "tight": TIGHT}
PAPER_AXES = ("pressure_bias=0.5:1.5:50", "initial_position=0.5:1.5:50")
"""Axes of the table in section III.B of the paper."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--axis", action="append", metavar="NAME=LOW:HIGH:COUNT",
                        help="an axis of the table: a parameter, the lowest and highest multiple of its value in the "
                             "model, and the number of equidistant grid points; repeat the option for each axis "
                             f"(default: {' and '.join(PAPER_AXES)}; with --machine all inputs)")
    add_model_arguments(parser, Path("tables/nominal.h5"))


def add_model_arguments(parser: argparse.ArgumentParser, out: Path) -> None:
    """Add the options that all tables share: model, conditions, output file (default `out`), threads and accuracy."""
    add_simulated_arguments(parser)
    add_machine_argument(parser)
    parser.add_argument("--out", type=Path, default=out, metavar="FILE",
                        help="the table file to write (default: %(default)s)")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1, metavar="N",
                        help="number of simulation threads, or of processes for a Python callable "
                             "(default: %(default)s, one per core; not used with --dask)")
    add_dask_argument(parser)
    parser.add_argument("--accuracy", choices=ACCURACIES, default="default",
                        help="accuracy of the time integration; at nominal parameters, shifting times of `default` "
                             "differ from those of `tight` by at most 1e-4 s")


def read_model_arguments(arguments: argparse.Namespace) -> tuple[Model, Conditions]:
    """Return the model and the conditions; raises `InvalidValue`, also if `--out` exists and is not a table."""
    require_output(arguments)
    _, model, conditions = open_simulated(arguments)
    if model.uses_run_order and conditions.run_order is None:
        raise InvalidValue("The model has an effect that depends on the run order, and these conditions have none",
                           "Give --conditions FILE: recordings with a run order, such as those that show the effect")
    return model, conditions


def require_output(arguments: argparse.Namespace) -> None:
    """Raise `InvalidValue` for too few threads, or if `--out` exists and is not a table."""
    if arguments.threads < 1:
        raise InvalidValue(f"{arguments.threads} threads are too few", "Give --threads 1 or more")
    if arguments.out.exists():
        require_table(arguments.out)


def run(arguments: argparse.Namespace) -> int:
    """Build the table and print its size, its statuses and its digest."""
    plan, executor, items = _machine_plan(arguments) if arguments.machine else _clutch_plan(arguments)
    progress = Progress(int(np.prod(plan.shape)) * len(plan.conditions), items)
    try:
        with executor:
            table = build(plan, arguments.out, executor, progress)
    except KeyboardInterrupt:
        print("\nStopped. Run the same command again to resume the build.", file=sys.stderr)
        return 130
    outcomes, option = STATUS, ""
    if isinstance(plan, MachineRuns):
        plan.tell_failures(table.status.reshape(-1, len(plan.conditions)))
        outcomes, option = OUTCOMES, f" --machine {arguments.machine}"
    counts = ", ".join(f"{np.count_nonzero(table.status == code):,} {name}" for code, name in outcomes.items())
    print(f"Wrote {arguments.out}: {' x '.join(map(str, table.times.shape))} {items} ({counts}), "
          f"digest {table.digest}\nCompare it with direct simulation: python -m worker verify {arguments.out}{option}")
    return 0


def _clutch_plan(arguments: argparse.Namespace) -> tuple[GridPlan, Executor, str]:
    """The plan, what runs it, and what its items are called."""
    model, conditions = read_model_arguments(arguments)
    axes = tuple(read_axis(text, model) for text in arguments.axis or PAPER_AXES)
    require_distinct(axes)
    require_memory(axes, len(conditions))
    plan = Plan(model, conditions, axes, ACCURACIES[arguments.accuracy])
    if arguments.dask is None:
        compile_simulator(model, conditions)
    return plan, open_executor(arguments.dask, lambda: ThreadPoolExecutor(arguments.threads)), "engagements"


def _machine_plan(arguments: argparse.Namespace) -> tuple[GridPlan, Executor, str]:
    """As `_clutch_plan`, for another machine, whose simulator is tried first."""
    require_output(arguments)
    file = open_machine_file(arguments)
    axes = machine_axes(file, arguments.axis, counted=True)
    require_distinct(axes)
    require_memory(axes, len(file.cases))
    plan = MachineRuns.on_grid(file, axes)
    plan.simulation.require_working(file.cases)
    return plan, open_executor(arguments.dask, lambda: start_executor(file, arguments.threads), file), "runs"


def require_distinct(axes: tuple[Axis, ...]) -> None:
    """Raise `InvalidValue` if two axes are of the same parameter."""
    names = [axis.name for axis in axes]
    if len(set(names)) < len(names):
        raise InvalidValue(f"A parameter has more than one axis: {', '.join(names)}", "Give each parameter one --axis")


def require_memory(axes: tuple[Axis, ...], conditions: int) -> None:
    """Raise `InvalidValue` if memory cannot hold the table twice, as needed to verify the written file, and its check.
    """
    cells = math.prod(len(axis.values) for axis in axes) * conditions
    required, installed = 21 * cells, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if required > installed:
        raise InvalidValue(f"A table of {cells:,} engagements needs {required / 1e9:,.0f} GB of memory, and this "
                           f"machine has {installed / 1e9:,.0f} GB", "Give fewer points per axis, or fewer axes")


def require_table(path: Path) -> None:
    """Raise `InvalidValue` if the file is not a table, so that a build never replaces recordings, for example."""
    try:
        Table.open(path)
    except WrongLayout as error:
        raise InvalidValue(f"'{path}' exists and is not a table of the current layout",
                           "Give another --out, or remove the file") from error
    except BadTable:
        pass  # a damaged table may be rebuilt


def read_axis(text: str, model: Model) -> Axis:
    """Axis from NAME=LOW:HIGH:COUNT; raises `InvalidValue`, and `UnknownName` if no parameter has that name."""
    name, _, grid = text.partition("=")
    index = parameters.index(name)
    try:
        low, high, count = grid.split(":")
        values = np.linspace(float(low), float(high), int(count))
    except ValueError as error:
        raise InvalidValue(f"'{text}' is not a valid axis",
                           "Write NAME=LOW:HIGH:COUNT, such as " + PAPER_AXES[0]) from error
    return Axis(name, values, model.parameters[index], parameters.PARAMETERS[index].unit)
