"""`surrogate`: train a neural-network table over any number of parameters on simulations at random points."""

import argparse
import math
import os
from collections.abc import Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import scipy

import slipstick
from slipstick.bench import parameters
from slipstick.bench.conditions import Conditions
from slipstick.black_box.simulation import start_executor
from slipstick.clutch.ensemble import LOCKED, TIGHT, Accuracy, shifting_times
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.table import Axis, HeldOut, Network, Surrogate
from slipstick.table.axis import box
from slipstick.table.surrogate import germs

from .build import ACCURACIES, add_model_arguments, read_model_arguments, require_distinct, require_output
from .building import simulated
from .compiling import compile_simulator
from .executors import explained, open_executor
from .machine_plan import MachineRuns, machine_axes, open_machine_file
from .plan import CHUNK, slices
from .progress import Progress
from .training import train

RUNS, STEPS, SEED = 20_000, 50_000, 1
FEWEST_RUNS = 100
HELD_OUT = 2000
"""Number of random points at which the error against the tight simulation is measured."""
_TRAINED_PER_HELD_OUT = 5
"""Training runs of another machine per held-out run, because its simulator may take seconds."""
_LARGEST_SEED = 1 << 32
_MARGIN = 0.02  # share of an axis between the suggested bound and the nearest point that does not lock


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
    if arguments.machine:
        surrogate = _of_machine(arguments)
    else:
        if not arguments.axis:
            raise InvalidValue("The surrogate has no axes", "Give --axis NAME=LOW:HIGH for each parameter")
        model, conditions = read_model_arguments(arguments)
        axes = tuple(read_span(text, model) for text in arguments.axis)
        require_distinct(axes)
        if arguments.dask is None:
            compile_simulator(model, conditions)
        with open_executor(arguments.dask, lambda: ThreadPoolExecutor(arguments.threads)) as executor:
            surrogate = build(model, conditions, axes, arguments.runs, arguments.steps, arguments.seed,
                              ACCURACIES[arguments.accuracy], executor)
        surrogate.write(arguments.out)
    print(f"Wrote {arguments.out}: surrogate {describe_error(surrogate)}; digest {surrogate.digest}\n"
          f"Compare it with direct simulation: python -m worker verify {arguments.out}"
          + f" --machine {arguments.machine}" * bool(arguments.machine))
    return 0


def build(model: Model, conditions: Conditions, axes: tuple[Axis, ...], runs: int = RUNS, steps: int = STEPS,
          seed: int = SEED, accuracy: Accuracy = ACCURACIES["default"], executor: Executor | None = None) -> Surrogate:
    """Simulate `runs` points, train on them, and measure the error at `HELD_OUT` held-out points.

    The same seed gives the same surrogate on any `executor`, by default one thread per core. Raises `InvalidValue`,
    also if an engagement does not lock at one of the points.
    """
    design, executor = _Design.of(axes, runs, HELD_OUT, steps, seed), executor or ThreadPoolExecutor(os.cpu_count())
    times = _simulate(model, conditions, axes, design.points, accuracy, executor)
    tight = _simulate(model, conditions, axes, design.held_out, TIGHT, executor)
    network, error = design.trained(axes, times, tight, steps)
    origin = (f"slipstick {slipstick.__version__}, trained on simulations with longest steps {accuracy.fine:g} s near "
              f"contact and {accuracy.coarse:g} s elsewhere, twice that while the pressure is smooth; error measured "
              f"with {TIGHT.fine:g} s and {TIGHT.coarse:g} s")
    return Surrogate(axes, network, error, runs, steps, seed, conditions, model, origin)


@dataclass(frozen=True, eq=False)
class _Design:
    """Training `points` (m, d), `held_out` points, and the random numbers of the training."""

    points: np.ndarray
    held_out: np.ndarray
    training: np.random.Generator

    @classmethod
    def of(cls, axes: tuple[Axis, ...], runs: int, held_out: int, steps: int, seed: int) -> "_Design":
        """A Latin hypercube of training points, and independent held-out points; raises `InvalidValue`."""
        if runs < FEWEST_RUNS or steps < 1 or not 0 <= seed < _LARGEST_SEED:
            raise InvalidValue(f"Cannot train a surrogate with {runs} runs, {steps} steps and seed {seed}",
                               f"Give {FEWEST_RUNS} or more runs, one or more steps, and a seed from 0 to 2^32 - 1")
        sampling, validation, training = np.random.default_rng(seed).spawn(3)
        lower, upper = box(axes)
        points = lower + (upper - lower) * scipy.stats.qmc.LatinHypercube(len(axes), rng=sampling).random(runs)
        return cls(points, validation.uniform(lower, upper, (held_out, len(axes))), training)

    def trained(self, axes: tuple[Axis, ...], times: np.ndarray, expected: np.ndarray,
                steps: int) -> tuple[Network, HeldOut]:
        """The network trained on the `times` (m, n) at the points, and its error against those `expected` elsewhere."""
        progress = Progress(steps, "training steps")
        network = train(germs(axes, self.points), times, steps, self.training, lambda done: progress(done, 0))
        return network, HeldOut.of(network(germs(axes, self.held_out)) - expected)


def _of_machine(arguments: argparse.Namespace) -> Surrogate:
    """Train and write a surrogate of another machine; a build that was stopped during the simulation resumes."""
    require_output(arguments)
    file = open_machine_file(arguments)
    axes = machine_axes(file, arguments.axis, counted=False)
    require_distinct(axes)
    runs, steps = arguments.runs, arguments.steps
    design = _Design.of(axes, runs, min(HELD_OUT, runs // _TRAINED_PER_HELD_OUT), steps, arguments.seed)
    plan = MachineRuns(file, axes, np.concatenate([design.points, design.held_out]))
    plan.simulation.require_working(file.cases)
    progress = Progress(len(plan.design) * len(file.cases), "runs")
    with (open_executor(arguments.dask, lambda: start_executor(file, arguments.threads), file) as executor,
          simulated(plan, arguments.out, executor, progress) as (_, outputs, status)):
        plan.tell_failures(status)
        _require_locked(axes, plan.design, status, "runs in the box have no output")
        network, error = design.trained(axes, outputs[:runs], outputs[runs:], steps)
        surrogate = Surrogate(axes, network, error, runs, steps, arguments.seed, file.cases, file.description,
                              plan.origin)
        surrogate.write(arguments.out)
    return surrogate


def read_span(text: str, model: Model) -> Axis:
    """Axis from NAME=LOW:HIGH; raises `InvalidValue`, and `UnknownName` if no parameter has that name."""
    name, _, span = text.partition("=")
    index = parameters.index(name)
    try:
        low, high = map(float, span.split(":"))
    except ValueError as error:
        raise InvalidValue(f"'{text}' is not a valid axis of a surrogate",
                           "Write NAME=LOW:HIGH, such as pressure_bias=0.8:1.2") from error
    return Axis(name, np.array([low, high]), model.parameters[index], parameters.PARAMETERS[index].unit)


def describe_error(surrogate: Surrogate) -> str:
    """The size of the surrogate and its stated error as text."""
    error, unit = surrogate.error, surrogate.output.unit

    def spelled(value: float) -> str:
        return f"{1e3 * value:.4f} ms" if unit == "s" else f"{value:.4g} {unit}"

    return (f"over {len(surrogate.axes)} axes from {surrogate.runs:,} runs; error at {error.points:,} held-out points: "
            f"{spelled(error.overall_rms)} RMS, {spelled(error.rms.max())} RMS in the worst condition, "
            f"{spelled(error.worst.max())} maximum")


def _simulate(model: Model, conditions: Conditions, axes: tuple[Axis, ...], points: np.ndarray, accuracy: Accuracy,
              executor: Executor) -> np.ndarray:
    names, blocks = [axis.name for axis in axes], slices(len(points), max(1, CHUNK // len(conditions)))
    simulate = partial(shifting_times, model, conditions, names, accuracy=accuracy, threads=1)
    times = np.empty((len(points), len(conditions)))
    status = np.empty(times.shape, np.uint8)
    progress = Progress(times.size, "engagements")
    with explained():
        for block, result in zip(blocks, executor.map(simulate, [points[block] for block in blocks]), strict=True):
            times[block], status[block] = result
            progress(block.stop * len(conditions), 0)
    _require_locked(axes, points, status)
    return times


def _require_locked(axes: Sequence[Axis], points: np.ndarray, status: np.ndarray,
                    what: str = "engagements in the box do not lock") -> None:
    """Raise `InvalidValue` if an engagement in the box does not lock, because its shifting time is undefined."""
    unlocked = status != LOCKED
    if not unlocked.any():
        return
    conditions, affected = np.flatnonzero(unlocked.any(axis=0)), points[unlocked.any(axis=1)]
    listed = ", ".join(map(str, conditions[:5])) + (" and others" if len(conditions) > 5 else "")
    cuts = []
    for axis, column in zip(axes, affected.T, strict=True):
        span = axis.upper - axis.lower
        low = math.ceil(1e3 * (column.max() + _MARGIN * span)) / 1e3
        high = math.floor(1e3 * (column.min() - _MARGIN * span)) / 1e3
        cuts.append(((low - axis.lower) / span, f"{axis.name}={low:g}:{axis.upper:g}"))
        cuts.append(((axis.upper - high) / span, f"{axis.name}={axis.lower:g}:{high:g}"))
    share, narrower = min(cuts)
    raise InvalidValue(
        f"{np.count_nonzero(unlocked):,} of {unlocked.size:,} {what}, in "
        f"{len(conditions)} condition(s) (zero-based indices: {listed})",
        f"Narrow an axis: --axis {narrower} excludes them and keeps {1 - share:.0%} of the box" if share < 1 else
        "Narrow the axes, or leave out these conditions")
