"""Surrogates of a clutch or a black box: runs at random points, the training, and the error at held-out points."""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import scipy

from slipstick import __version__
from slipstick.bench.conditions import Conditions
from slipstick.black_box import BlackBox
from slipstick.building.black_box_runs import BlackBoxRuns
from slipstick.building.chunks import complete_chunks, simulate_chunks
from slipstick.building.plan import CHUNK, slices
from slipstick.building.training import train
from slipstick.clutch.ensemble import DEFAULT, LOCKED, TIGHT, Accuracy, shifting_times
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.table import Axis, HeldOut, Network, Surrogate
from slipstick.table.axis import box
from slipstick.table.surrogate import germs

RUNS, STEPS, SEED = 20_000, 50_000, 1
FEWEST_RUNS = 100
HELD_OUT = 2000
"""Number of random points at which the error against the tight simulation is measured."""
_TRAINED_PER_HELD_OUT = 5
"""Training runs of a black box per held-out run, because its simulator may take seconds."""
_LARGEST_SEED = 1 << 32
_MARGIN = 0.02  # share of an axis between the suggested bound and the nearest point that does not lock

Count = Callable[[int, int, str, int], None]
"""Called with how many of how many items are done, what they are, and how many of them an earlier run did."""


@dataclass(frozen=True)
class Training:
    """A training on `runs` points in `steps` steps, with a `seed` of the points and of the training.

    Raises `InvalidValue`.
    """

    runs: int = RUNS
    steps: int = STEPS
    seed: int = SEED

    def __post_init__(self) -> None:
        """Check the ranges."""
        if self.runs < FEWEST_RUNS or self.steps < 1 or not 0 <= self.seed < _LARGEST_SEED:
            raise InvalidValue(f"Cannot train a surrogate with {self.runs} runs, {self.steps} steps and seed "
                               f"{self.seed}",
                               f"Give {FEWEST_RUNS} or more runs, one or more steps, and a seed from 0 to 2^32 - 1")


def train_on_clutch(model: Model, conditions: Conditions, axes: tuple[Axis, ...], training: Training,
                    executor: Executor, accuracy: Accuracy = DEFAULT, count: Count = lambda *_: None) -> Surrogate:
    """A surrogate of a clutch, trained on the points of `training` with the error at `HELD_OUT` held-out points.

    The same seed gives the same surrogate on any `executor`. Raises `InvalidValue`, also if an engagement does not lock
    at one of the points.
    """
    design = _Design.of(axes, training, HELD_OUT)
    times = _simulate(model, conditions, axes, design.points, accuracy, executor, count)
    tight = _simulate(model, conditions, axes, design.held_out, TIGHT, executor, count)
    origin = (f"slipstick {__version__}, trained on simulations with longest steps {accuracy.fine:g} s near "
              f"contact and {accuracy.coarse:g} s elsewhere, twice that while the pressure is smooth; error measured "
              f"with {TIGHT.fine:g} s and {TIGHT.coarse:g} s")
    network, error = design.train_network(axes, times, tight, training.steps, count)
    return Surrogate(axes, network, error, training.runs, training.steps, training.seed, conditions, model, origin)


def train_on_black_box(file: BlackBox, axes: tuple[Axis, ...], training: Training, executor: Executor,
                       out: Path | None = None, count: Count = lambda *_: None,
                       tell: Callable[[str], None] = lambda _: None) -> Surrogate:
    """As `train_on_clutch`, of a black box; with `out` it is written there, and one stopped during its runs resumes.

    `tell` is called with lines about runs that failed. Raises `InvalidValue` if one of the points has no output.
    """
    runs, steps, seed = training.runs, training.steps, training.seed
    design = _Design.of(axes, training, min(HELD_OUT, runs // _TRAINED_PER_HELD_OUT))
    plan = BlackBoxRuns(file, axes, np.concatenate([design.points, design.held_out]))
    plan.simulation.require_working(file.cases)
    total = len(plan.design) * len(file.cases)
    with complete_chunks(plan, out, executor,
                         lambda done, resumed: count(done, total, "runs", resumed)) as (_, outputs, status):
        for line in plan.failures(status):
            tell(line)
        _require_locked(axes, plan.design, status, "runs in the box have no output")
        network, error = design.train_network(axes, outputs[:runs], outputs[runs:], steps, count)
        surrogate = Surrogate(axes, network, error, runs, steps, seed, file.cases, file.description, plan.origin)
        if out is not None:
            surrogate.save(out)
    return surrogate


@dataclass(frozen=True, eq=False)
class _Design:
    """Training `points` (m, d), `held_out` points, and the random numbers of the training."""

    points: np.ndarray
    held_out: np.ndarray
    training: np.random.Generator

    @classmethod
    def of(cls, axes: tuple[Axis, ...], training: Training, held_out: int) -> "_Design":
        """A Latin hypercube of training points, and independent held-out points."""
        sampling, validation, further = np.random.default_rng(training.seed).spawn(3)
        lower, upper = box(axes)
        points = lower + (upper - lower) * scipy.stats.qmc.LatinHypercube(len(axes), rng=sampling).random(training.runs)
        return cls(points, validation.uniform(lower, upper, (held_out, len(axes))), further)

    def train_network(self, axes: tuple[Axis, ...], times: np.ndarray, expected: np.ndarray, steps: int,
                      count: Count) -> tuple[Network, HeldOut]:
        """The network trained on the `times` (m, n) at the points, and its error against those `expected` elsewhere."""
        network = train(germs(axes, self.points), times, steps, self.training,
                        lambda done: count(done, steps, "training steps", 0))
        return network, HeldOut.of(network(germs(axes, self.held_out)) - expected)


def _simulate(model: Model, conditions: Conditions, axes: tuple[Axis, ...], points: np.ndarray, accuracy: Accuracy,
              executor: Executor, count: Count) -> np.ndarray:
    names, blocks = [axis.name for axis in axes], slices(len(points), max(1, CHUNK // len(conditions)))
    simulate = partial(shifting_times, model, conditions, names, accuracy=accuracy, threads=1)
    times = np.empty((len(points), len(conditions)))
    status = np.empty(times.shape, np.uint8)
    done = 0
    count(done, times.size, "engagements", 0)
    with closing(simulate_chunks(simulate, points.__getitem__, blocks, executor)) as results:
        for block, *result in results:
            times[block], status[block] = result
            done += times[block].size
            count(done, times.size, "engagements", 0)
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
        f"Narrow an axis: {narrower} excludes them and keeps {1 - share:.0%} of the box" if share < 1 else
        "Narrow the axes, or leave out these conditions")
