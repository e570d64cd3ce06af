"""`surrogate`: train a neural-network table over any number of parameters on simulations at random points."""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.stats import qmc

import slipstick
from slipstick.bench import parameters
from slipstick.bench.conditions import Conditions
from slipstick.clutch.ensemble import LOCKED, TIGHT, Accuracy, shifting_times
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.table import Axis, HeldOut, Surrogate
from slipstick.table.axis import box
from slipstick.table.surrogate import germs
from worker.build import ACCURACIES, add_model_arguments, read_model_arguments, require_distinct
from worker.progress import Progress
from worker.training import train

RUNS, STEPS, SEED = 20_000, 50_000, 1
FEWEST_RUNS = 100
HELD_OUT = 2000
"""Number of random points at which the error against the tight simulation is measured."""
_BLOCK = 200_000  # engagements between two progress reports
_LARGEST_SEED = 1 << 32
_MARGIN = 0.02  # share of an axis between the suggested bound and the nearest point that does not lock


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--axis", action="append", metavar="NAME=LOW:HIGH", required=True,
                        help="an axis of the table: a parameter, and the lowest and highest multiple of its value in "
                             "the model; repeat the option for each axis")
    parser.add_argument("--runs", type=int, default=RUNS, metavar="N",
                        help="number of training points to simulate (default: %(default)s)")
    parser.add_argument("--steps", type=int, default=STEPS, metavar="N",
                        help="number of training steps; 50,000 take about a minute (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=SEED,
                        help="seed of the points and of the training (default: %(default)s)")
    add_model_arguments(parser, Path("tables/surrogate.h5"))


def run(arguments: argparse.Namespace) -> int:
    """Train the surrogate, write it, and print its error."""
    model, conditions = read_model_arguments(arguments)
    axes = tuple(read_span(text, model) for text in arguments.axis)
    require_distinct(axes)
    surrogate = build(model, conditions, axes, arguments.runs, arguments.steps, arguments.seed,
                      ACCURACIES[arguments.accuracy], arguments.threads)
    surrogate.write(arguments.out)
    print(f"Wrote {arguments.out}: surrogate {describe_error(surrogate)}; digest {surrogate.digest}\n"
          f"Compare it with direct simulation: python -m worker verify {arguments.out}")
    return 0


def build(model: Model, conditions: Conditions, axes: tuple[Axis, ...], runs: int = RUNS, steps: int = STEPS,
          seed: int = SEED, accuracy: Accuracy = ACCURACIES["default"], threads: int | None = None) -> Surrogate:
    """Simulate `runs` points, train on them, and measure the error at `HELD_OUT` held-out points.

    The same seed gives the same surrogate on any number of threads. Raises `InvalidValue`, also if an engagement does
    not lock at one of the points.
    """
    if runs < FEWEST_RUNS or steps < 1 or not 0 <= seed < _LARGEST_SEED:
        raise InvalidValue(f"Cannot train a surrogate with {runs} runs, {steps} steps and seed {seed}",
                           f"Give {FEWEST_RUNS} or more runs, one or more steps, and a seed from 0 to 2^32 - 1")
    sampling, validation, training = np.random.default_rng(seed).spawn(3)
    lower, upper = box(axes)
    points = lower + (upper - lower) * qmc.LatinHypercube(len(axes), rng=sampling).random(runs)
    held_out = validation.uniform(lower, upper, (HELD_OUT, len(axes)))
    times = _simulate(model, conditions, axes, points, accuracy, threads)
    tight = _simulate(model, conditions, axes, held_out, TIGHT, threads)
    progress = Progress(steps, "training steps")
    network = train(germs(axes, points), times, steps, training, lambda done: progress(done, 0))
    error = HeldOut.of(network(germs(axes, held_out)) - tight)
    origin = (f"slipstick {slipstick.__version__}, trained on simulations with longest steps {accuracy.fine:g} s near "
              f"contact and {accuracy.coarse:g} s elsewhere, twice that while the pressure is smooth; error measured "
              f"with {TIGHT.fine:g} s and {TIGHT.coarse:g} s")
    return Surrogate(axes, network, error, runs, steps, seed, conditions, model, origin)


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
    error = surrogate.error
    return (f"over {len(surrogate.axes)} axes from {surrogate.runs:,} runs; error at {error.points:,} held-out points: "
            f"{1e3 * error.overall_rms:.4f} ms RMS, {1e3 * error.rms.max():.4f} ms RMS in the worst condition, "
            f"{1e3 * error.worst.max():.3f} ms maximum")


def _simulate(model: Model, conditions: Conditions, axes: tuple[Axis, ...], points: np.ndarray, accuracy: Accuracy,
              threads: int | None) -> np.ndarray:
    names, size = [axis.name for axis in axes], max(1, _BLOCK // len(conditions))
    times = np.empty((len(points), len(conditions)))
    status = np.empty(times.shape, np.uint8)
    progress = Progress(times.size, "engagements")
    for first in range(0, len(points), size):
        block = slice(first, first + size)
        times[block], status[block] = shifting_times(model, conditions, names, points[block], accuracy, threads)
        progress(times[block].size + first * len(conditions), 0)
    _require_locked(axes, points, status)
    return times


def _require_locked(axes: Sequence[Axis], points: np.ndarray, status: np.ndarray) -> None:
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
        f"{np.count_nonzero(unlocked):,} of {unlocked.size:,} engagements in the box do not lock, in "
        f"{len(conditions)} condition(s) (zero-based indices: {listed})",
        f"Narrow an axis: --axis {narrower} excludes them and keeps {1 - share:.0%} of the box" if share < 1 else
        "Narrow the axes, or leave out these conditions")
