"""`slipstick.surrogate`: a neural-network table over more parameters than a grid can have."""

import sys
from concurrent.futures import Executor
from pathlib import Path

from slipstick.bench import Bench
from slipstick.bench.conditions import Conditions
from slipstick.black_box import BlackBox
from slipstick.building import axes_of, compile_simulator, say_compilation, train_on_black_box, train_on_clutch
from slipstick.building.axes import Spans
from slipstick.building.surrogates import RUNS, SEED, STEPS, Training
from slipstick.errors import within_memory
from slipstick.interface.build import (
    accuracy_of,
    refuse_for_black_box,
    require_table,
    require_threads,
    resumable,
    runnable,
    running,
)
from slipstick.interface.models import ModelLike, conditions_of, model_of
from slipstick.interface.progress import ProgressLine, Show, counting
from slipstick.recordings import Recordings
from slipstick.table import Surrogate


@within_memory()
def surrogate(machine: Bench | BlackBox, axes: Spans | None = None, *, model: ModelLike | None = None,
              conditions: Conditions | Recordings | None = None, out: Path | str | None = None, runs: int = RUNS,
              steps: int = STEPS, seed: int = SEED, accuracy: str = "default", threads: int | None = None,
              executor: Executor | None = None, progress: bool | Show | ProgressLine = True) -> Surrogate:
    """Train a network on simulations at random points of a box, and measure its error at others.

    It takes the parameters of `slipstick.build`, but that `axes` maps a parameter to (low, high), without a default for
    a bench. The same seed gives the same surrogate. One of a black box with `out` that was stopped during its runs is
    resumed by the same call.

    Parameters
    ----------
    machine, axes, model, conditions, out, accuracy, threads, executor, progress
        As in `slipstick.build`.
    runs : int, optional
        Number of training points to simulate, 100 or more.
    steps : int, optional
        Number of training steps; 50,000 take about a minute.
    seed : int, optional
        Seed of the points and of the training.

    Returns
    -------
    Surrogate
        A `slipstick.Table`; `error` says how far it is from direct simulation.

    Raises
    ------
    InvalidValue
        As `slipstick.build`, and if an engagement does not lock, or a run has no output, at one of the points.
    UnknownName
        For a parameter or an accuracy that does not exist.

    """
    path, training = None if out is None else Path(out), Training(runs, steps, seed)
    require_threads(threads)
    require_table(path)
    if isinstance(machine, BlackBox):
        refuse_for_black_box(model, conditions, accuracy)
        ranges = {entry.name: (entry.lower, entry.upper) for entry in machine.description.inputs}
        box = axes_of(machine.description, ranges if axes is None else axes, counted=False)
        with running(machine, threads, executor) as given, resumable(path), counting(progress) as count:
            return train_on_black_box(machine, box, training, given, path, count,
                                      lambda line: print(line, file=sys.stderr))
    simulated, taken = runnable(model_of(machine, model), conditions_of(machine, conditions))
    box = axes_of(simulated, axes or {}, counted=False)
    if executor is None:
        compile_simulator(simulated, taken)
    with say_compilation(), running(machine, threads, executor) as given, counting(progress) as count:
        trained = train_on_clutch(simulated, taken, box, training, given, accuracy_of(accuracy), count)
    if path is not None:
        trained.save(path)
    return trained
