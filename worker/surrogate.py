"""`surrogate`: train a table over any number of parameters on simulations at random points."""

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
"""Points at which the error is measured, by the tight simulation."""
_BLOCK = 200_000  # engagements between two reports
_LARGEST_SEED = 1 << 32
_CLEARANCE = 0.02  # of an axis, between what is advised and the last point that did not lock


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command line."""
    parser.add_argument("--axis", action="append", metavar="NAME=LOW:HIGH", required=True,
                        help="a parameter and the range of multipliers of its value; once for each axis")
    parser.add_argument("--runs", type=int, default=RUNS, metavar="N",
                        help="points to simulate for the training (default: %(default)s)")
    parser.add_argument("--steps", type=int, default=STEPS, metavar="N",
                        help="of the training, about a minute for each 50,000 (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=SEED, help="of points and training (default: %(default)s)")
    add_model_arguments(parser, Path("tables/surrogate.h5"))


def run(arguments: argparse.Namespace) -> int:
    """Train the surrogate, write it, and say how far off it is."""
    model, conditions = read_model_arguments(arguments)
    axes = tuple(read_span(text, model) for text in arguments.axis)
    require_distinct(axes)
    surrogate = build(model, conditions, axes, arguments.runs, arguments.steps, arguments.seed,
                      ACCURACIES[arguments.accuracy], arguments.threads)
    surrogate.write(arguments.out)
    print(f"{arguments.out}: surrogate {describe_error(surrogate)}, digest {surrogate.digest}")
    return 0


def build(model: Model, conditions: Conditions, axes: tuple[Axis, ...], runs: int = RUNS, steps: int = STEPS,
          seed: int = SEED, accuracy: Accuracy = ACCURACIES["default"], threads: int | None = None) -> Surrogate:
    """Simulate `runs` points, train on them, and measure the error at `HELD_OUT` fresh points.

    The same seed gives the same surrogate on any number of threads. Raises `InvalidValue`, also where an engagement
    does not lock at one of the points.
    """
    if runs < FEWEST_RUNS or steps < 1 or not 0 <= seed < _LARGEST_SEED:
        raise InvalidValue(f"{runs} runs, {steps} steps and seed {seed} train no surrogate",
                           f"Give {FEWEST_RUNS} runs or more, a step or more, and a seed from 0 to 2^32 - 1")
    places, fresh, training = np.random.default_rng(seed).spawn(3)
    lower, upper = box(axes)
    points = lower + (upper - lower) * qmc.LatinHypercube(len(axes), rng=places).random(runs)
    held_out = fresh.uniform(lower, upper, (HELD_OUT, len(axes)))
    times = _simulate(model, conditions, axes, points, accuracy, threads)
    tight = _simulate(model, conditions, axes, held_out, TIGHT, threads)
    progress = Progress(steps, "steps of the training")
    network = train(germs(axes, points), times, steps, training, lambda done: progress(done, 0))
    error = HeldOut.of(network(germs(axes, held_out)) - tight)
    origin = (f"slipstick {slipstick.__version__}, trained on steps of {accuracy.fine:g} s at contact and "
              f"{accuracy.coarse:g} s elsewhere, twice that in calm, and held against {TIGHT.fine:g} s and "
              f"{TIGHT.coarse:g} s")
    return Surrogate(axes, network, error, runs, steps, seed, conditions, model, origin)


def read_span(text: str, model: Model) -> Axis:
    """Read NAME=LOW:HIGH; raises `InvalidValue`, and `UnknownName` for a parameter the model lacks."""
    name, _, span = text.partition("=")
    index = parameters.index(name)
    try:
        low, high = map(float, span.split(":"))
    except ValueError as error:
        raise InvalidValue(f"'{text}' is no axis of a surrogate",
                           "Write NAME=LOW:HIGH, such as pressure_bias=0.8:1.2") from error
    return Axis(name, np.array([low, high]), model.parameters[index], parameters.PARAMETERS[index].unit)


def describe_error(surrogate: Surrogate) -> str:
    """The stated error in words."""
    error = surrogate.error
    return (f"over {len(surrogate.axes)} axes from {surrogate.runs:,} runs, {1e3 * error.overall_rms:.4f} ms RMS, "
            f"{1e3 * error.rms.max():.4f} ms in the worst condition, {1e3 * error.worst.max():.3f} ms at most from "
            f"direct simulation at {error.points:,} fresh points")


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
    """Refuse a box in which an engagement does not lock: it has no time that a network could be trained on."""
    lost = status != LOCKED
    if not lost.any():
        return
    numbers, where = np.flatnonzero(lost.any(axis=0)), points[lost.any(axis=1)]
    named = ", ".join(map(str, numbers[:5])) + (" and others" if len(numbers) > 5 else "")
    cuts = []
    for axis, column in zip(axes, where.T, strict=True):
        span = axis.upper - axis.lower
        low = math.ceil(1e3 * (column.max() + _CLEARANCE * span)) / 1e3
        high = math.floor(1e3 * (column.min() - _CLEARANCE * span)) / 1e3
        cuts.append(((low - axis.lower) / span, f"{axis.name}={low:g}:{axis.upper:g}"))
        cuts.append(((axis.upper - high) / span, f"{axis.name}={axis.lower:g}:{high:g}"))
    share, narrower = min(cuts)
    raise InvalidValue(
        f"{np.count_nonzero(lost):,} of {lost.size:,} engagements in the box do not lock, under {len(numbers)} "
        f"condition(s) (counted from 0: {named})",
        f"Narrow an axis: --axis {narrower} leaves them out and {1 - share:.0%} of the box" if share < 1 else
        "Narrow the axes, or leave these conditions out")
