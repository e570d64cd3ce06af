"""`slipstick.build`: a table of shifting times, or of the output of a black box, on a grid."""

import os
import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from slipstick.bench import Bench
from slipstick.bench.conditions import Conditions
from slipstick.black_box import BlackBox
from slipstick.black_box.simulation import start_executor
from slipstick.building import (
    BlackBoxRuns,
    Plan,
    axes_of,
    build_grid,
    compile_simulator,
    require_memory,
    say_compilation,
)
from slipstick.building.axes import Spans
from slipstick.clutch.ensemble import DEFAULT, TIGHT, Accuracy
from slipstick.clutch.model import Model
from slipstick.errors import BadTable, InvalidValue, UnknownName, WrongLayout, require_whole
from slipstick.interface.files import require_suffix
from slipstick.interface.models import BenchLike, ModelLike, bench_of, conditions_of, model_of
from slipstick.interface.progress import ProgressLine, Show, counting
from slipstick.recordings import Recordings
from slipstick.table import Grid, Table

ACCURACIES: Mapping[str, Accuracy] = {"default": DEFAULT, "tight": TIGHT}
"""Accuracies of the time integration by name."""
PAPER_AXES: Spans = {"pressure_bias": (0.5, 1.5, 50), "initial_position": (0.5, 1.5, 50)}
"""Axes of the table in section III.B of the paper."""


def build(machine: BenchLike | BlackBox, axes: Spans | None = None, *, model: ModelLike | None = None,
          conditions: Conditions | Recordings | None = None, out: Path | str | None = None, accuracy: str = "default",
          threads: int | None = None, executor: Executor | None = None,
          progress: bool | Show | ProgressLine = True) -> Grid:
    """Simulate a table on a grid of parameters: one run at each grid point under each condition.

    With `out`, a build that was killed, or interrupted by Ctrl-C, is resumed by the same call. The table depends
    neither on interruptions nor on what computes it.

    Parameters
    ----------
    machine : Bench, BlackBox, str or Path
        A bench, the name of a shipped one, or the path of its file; or a black box, which has its own conditions and
        accuracy, and no model.
    axes : mapping, optional
        Parameter -> (low, high, count): `count` equidistant multiples of its value in the model, from `low` to `high`.
        By default the two axes of the paper, or all inputs of a black box over their ranges.
    model : Model, result or path, optional
        The model to simulate: a `Model`, a result that has one, or a JSON file of either. By default that with the
        nominal parameters of the bench.
    conditions : Conditions or Recordings, optional
        The conditions to simulate, or recordings made under them; by default those of the bench.
    out : Path or str, optional
        The file of the table. Without it the table is computed in memory only.
    accuracy : {"default", "tight"}
        Accuracy of the time integration: shifting times of "default" are within 1e-4 s of those of "tight".
    threads : int, optional
        Number of threads, or of processes for a Python callable as black box; by default one per core. Processes import
        the script that calls this function: call it below `if __name__ == "__main__":`.
    executor : concurrent.futures.Executor, optional
        What computes instead, such as workers of other computers; it is not shut down.
    progress : bool or callable, optional
        Whether to show a bar in a terminal or notebook, or a function of a text and of the share that is complete.

    Returns
    -------
    Grid
        A `slipstick.Table` with times in s, NaN where an engagement does not lock.

    Raises
    ------
    InvalidValue
        For axes, conditions or a model that do not fit, too little memory, a file that is no table, and a build of the
        same table in another process.
    UnknownName
        For a parameter or an accuracy that does not exist.
    """
    path = None if out is None else Path(out)
    require_threads(threads)
    require_table(path)
    machine = machine if isinstance(machine, BlackBox) else bench_of(machine)
    runs: Plan | BlackBoxRuns
    if isinstance(machine, BlackBox):
        refuse_for_black_box(model, conditions, accuracy)
        runs, items = _black_box_runs(machine, axes), "runs"
    else:
        runs, items = plan_of_bench(machine, axes, model, conditions, accuracy), "engagements"
        if executor is None:
            compile_simulator(runs.model, runs.conditions)
    total = runs.chunks[-1].stop * len(runs.conditions)
    most = min(threads or os.cpu_count() or 1, len(runs.chunks))
    with (say_compilation(), running(machine, most, executor) as given, resumable(path), counting(progress) as count):
        table = build_grid(runs, path, given, lambda done, resumed: count(done, total, items, resumed))
    if isinstance(runs, BlackBoxRuns):
        for line in runs.failures(table.status.reshape(-1, len(runs.conditions))):
            print(line, file=sys.stderr)
    return table


def plan_of_bench(bench: Bench, axes: Spans | None, given: ModelLike | None,
                  conditions: Conditions | Recordings | None, accuracy: str) -> Plan:
    """The runs of a table of a bench; raises what `build` raises for its arguments."""
    steps = accuracy_of(accuracy)
    model, simulated = runnable(model_of(bench, given), conditions_of(bench, conditions))
    chosen = axes_of(model, PAPER_AXES if axes is None else axes)
    require_memory(chosen, len(simulated))
    return Plan(model, simulated, chosen, steps)


def _black_box_runs(file: BlackBox, axes: Spans | None) -> BlackBoxRuns:
    ranges = {entry.name: (entry.lower, entry.upper, points)
              for entry, points in zip(file.description.inputs, file.points, strict=True)}
    chosen = axes_of(file.description, ranges if axes is None else axes)
    require_memory(chosen, len(file.cases))
    runs = BlackBoxRuns.on_grid(file, chosen)
    runs.simulation.require_working(file.cases)
    return runs


def accuracy_of(name: str) -> Accuracy:
    """The accuracy of this name; raises `UnknownName`."""
    if name not in ACCURACIES:
        raise UnknownName.of("accuracy", name, ACCURACIES)
    return ACCURACIES[name]


def refuse_for_black_box(model: object, conditions: object, accuracy: str) -> None:
    """Raise `InvalidValue` for a model, conditions or an accuracy, which the file of a black box has itself."""
    given = {"model": model is not None, "conditions": conditions is not None, "accuracy": accuracy != "default"}
    for name, is_given in given.items():
        if is_given:
            raise InvalidValue(f"A black box takes no {name}",
                               "Leave it out: the file of the machine describes its simulator and its conditions")


def runnable(model: Model, conditions: Conditions) -> tuple[Model, Conditions]:
    """Model and conditions; raises `InvalidValue` if the model needs a run order that the conditions do not have."""
    if model.uses_run_order and conditions.run_order is None:
        raise InvalidValue("The model has an effect that depends on the run order, and these conditions have none",
                           "Give as conditions recordings with a run order, such as those that show the effect")
    return model, conditions


def require_threads(threads: int | None) -> None:
    """Raise `InvalidValue` for too few threads."""
    require_whole(threads=threads)
    if threads is not None and threads < 1:
        raise InvalidValue(f"{threads} threads are too few", "Give 1 or more")


def require_table(path: Path | None) -> None:
    """Raise `InvalidValue` unless a table can be written to `path`: a build never replaces recordings."""
    if path is None:
        return
    require_suffix(path, ".h5")
    if not path.exists():
        return
    try:
        Table.open(path)
    except WrongLayout as error:
        raise InvalidValue(f"'{path}' exists and is not a table of the current layout",
                           "Give another path, or remove the file") from error
    except BadTable:
        pass  # a damaged table may be rebuilt


@contextmanager
def resumable(path: Path | None) -> Iterator[None]:
    """Say, where Ctrl-C ends the block, that what is done is kept in files beside `path`."""
    try:
        yield
    except KeyboardInterrupt:
        if path is not None:
            print("Stopped. Run the same command or call again to resume.", file=sys.stderr)
        raise


@contextmanager
def running(machine: Bench | BlackBox, threads: int | None, executor: Executor | None) -> Iterator[Executor]:
    """The `executor`, or without one a new one on this machine, which is shut down after the block."""
    if executor is not None:
        yield executor
        return
    count = threads or os.cpu_count() or 1
    with start_executor(machine, count) if isinstance(machine, BlackBox) else ThreadPoolExecutor(count) as new:
        yield new
