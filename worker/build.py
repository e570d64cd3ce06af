"""`build`: simulate a table over any parameters as axes."""

import argparse
import json
import math
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from slipstick.bench import parameters
from slipstick.bench.conditions import Conditions, paper_conditions
from slipstick.clutch.ensemble import DEFAULT, STATUS, TIGHT
from slipstick.clutch.model import Model
from slipstick.errors import BadTable, InvalidValue, WrongLayout
from slipstick.recordings import open_conditions
from slipstick.table import Axis, Table
from worker.building import build
from worker.plan import Plan
from worker.progress import Progress

ACCURACIES = {"default": DEFAULT, "tight": TIGHT}
PAPER_AXES = ("pressure_bias=0.5:1.5:50", "initial_position=0.5:1.5:50")
"""The table of the paper's section III.B."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command line."""
    parser.add_argument("--axis", action="append", metavar="NAME=LOW:HIGH:COUNT",
                        help="a parameter and the multipliers of its value; once for each axis, in the order of the "
                             f"table (default: {' and '.join(PAPER_AXES)})")
    add_model_arguments(parser, Path("tables/nominal.h5"))


def add_model_arguments(parser: argparse.ArgumentParser, out: Path) -> None:
    """Describe what every table is made of and where it goes."""
    parser.add_argument("--model", type=Path, metavar="SPEC.json",
                        help="a model as JSON, or a calibration that holds one (default: the nominal parameters)")
    parser.add_argument("--conditions", type=Path, metavar="FILE",
                        help="recordings whose conditions to simulate (default: the 216 of the paper)")
    parser.add_argument("--out", type=Path, default=out, metavar="FILE",
                        help="where to put the table (default: %(default)s)")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1, metavar="N",
                        help="simulations at a time (default: %(default)s, one a core)")
    parser.add_argument("--accuracy", choices=ACCURACIES, default="default",
                        help="of the integration: at nominal parameters default is within 1e-4 s of tight")


def read_model_arguments(arguments: argparse.Namespace) -> tuple[Model, Conditions]:
    """Open what these name; raises `InvalidValue`, also where the table would replace something else."""
    if arguments.threads < 1:
        raise InvalidValue(f"{arguments.threads} threads cannot build", "Give --threads 1 or more")
    if arguments.out.exists():
        require_table(arguments.out)
    model = read_model(arguments.model) if arguments.model else Model()
    conditions = open_conditions(arguments.conditions) if arguments.conditions else paper_conditions()
    if model.uses_run_order and conditions.run_order is None:
        raise InvalidValue("The model has an effect that drifts from run to run, and these conditions are in no order",
                           "Give --conditions FILE: recordings with a run order, such as those it was found on")
    return model, conditions


def run(arguments: argparse.Namespace) -> int:
    """Build the table and say what came out."""
    model, conditions = read_model_arguments(arguments)
    axes = tuple(read_axis(text, model) for text in arguments.axis or PAPER_AXES)
    require_distinct(axes)
    require_memory(axes, len(conditions))
    plan = Plan(model, conditions, axes, ACCURACIES[arguments.accuracy])
    progress = Progress(int(np.prod(plan.shape)) * len(conditions), "engagements")
    try:
        with ThreadPoolExecutor(arguments.threads) as executor:
            table = build(plan, arguments.out, executor, progress)
    except KeyboardInterrupt:
        print("\nStopped; the same command goes on from here", file=sys.stderr)
        return 130
    counts = ", ".join(f"{np.count_nonzero(table.status == code):,} {name}" for code, name in STATUS.items())
    print(f"{arguments.out}: {' x '.join(map(str, table.times.shape))} engagements ({counts}), digest {table.digest}")
    return 0


def require_distinct(axes: tuple[Axis, ...]) -> None:
    """Raise `InvalidValue` where two axes are of one parameter."""
    names = [axis.name for axis in axes]
    if len(set(names)) < len(names):
        raise InvalidValue(f"An axis appears twice: {', '.join(names)}", "Give each parameter one --axis")


def require_memory(axes: tuple[Axis, ...], conditions: int) -> None:
    """Raise `InvalidValue` where the table, held twice while it is verified, would not fit into memory."""
    cells = math.prod(len(axis.values) for axis in axes) * conditions
    need, have = 2 * 9 * cells, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if need > have:
        raise InvalidValue(f"A table of {cells:,} engagements needs {need / 1e9:,.0f} GB of memory, and there are "
                           f"{have / 1e9:,.0f}", "Take fewer points an axis, or fewer axes")


def require_table(path: Path) -> None:
    """Raise `InvalidValue` where a build would replace a file that is something else, such as recordings."""
    try:
        Table.open(path)
    except WrongLayout as error:
        raise InvalidValue(f"'{path}' is there already and no table of this layout",
                           "Give another --out, or remove it") from error
    except BadTable:
        pass  # a damaged table may be built again


def read_axis(text: str, model: Model) -> Axis:
    """Read NAME=LOW:HIGH:COUNT; raises `InvalidValue`, and `UnknownName` for a parameter the model lacks."""
    name, _, grid = text.partition("=")
    index = parameters.index(name)
    try:
        low, high, count = grid.split(":")
        values = np.linspace(float(low), float(high), int(count))
    except ValueError as error:
        raise InvalidValue(f"'{text}' is no axis", "Write NAME=LOW:HIGH:COUNT, such as " + PAPER_AXES[0]) from error
    return Axis(name, values, model.parameters[index], parameters.PARAMETERS[index].unit)


def read_model(path: Path) -> Model:
    """Read the model in a JSON file, at its top or under "model"; raises `InvalidValue`, `UnknownName`."""
    try:
        content = json.loads(path.read_text())
        return Model.from_spec(content.get("model", content))
    except (OSError, ValueError, AttributeError, KeyError, TypeError) as error:
        raise InvalidValue(f"'{path}' holds no model ({type(error).__name__}: {error})",
                           "Give the JSON of a model's spec or of a calibration") from error
