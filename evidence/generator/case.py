"""A case: a bench, hidden effects and deviations from the nominal bench; it determines the recordings."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from . import bad_runs, sensors
from .bench import SENSORS, Bench
from .effect import Acting, Effect
from .engagements import Engagements
from .run import Run, observe
from .temptations import READING, oil_temperature, second_batch
from .valve import play, plays
from .world import World, plain_world, with_errors, with_other_curves

TIME_STEP = 1e-4  # s, resolution of the shifting times
LEAST_RUNS = 4  # in which an effect acts
_CONDITIONS, _NOISE, _BAD_RUNS, _DEVIATIONS, _TEMPERATURE, _THERMOMETER, _FEW = range(7)
"""Streams of random numbers of a case."""


@dataclass(frozen=True)
class Hidden:
    """An `effect` of an `amplitude` that acts in a `share` of the runs, and its `strength`.

    The strength is the residual that it leaves, over the noise (strength.py); 0 where it has not been computed.
    """

    effect: Effect
    amplitude: float
    share: float = 1.0
    strength: float = 0.0


@dataclass(frozen=True, eq=False)
class Case:
    """The specification of a set of recordings; cases from the same numbers give identical files.

    `key` are the integers from which the case draws. `count` of the conditions of the bench are run, with every level
    of every factor about equally often. `hidden` are its effects. `world` are further deviations of the bench, by
    default noise and the scatter of two parameters. `factors` multiply the mean of parameters, in addition to a
    deviation of the calibrated ones with a std of `shift`, clipped at 2.7 of it. Signals that are `missing` are not
    recorded.
    """

    name: str
    key: tuple[int, ...]
    bench: Bench
    count: int
    hidden: tuple[Hidden, ...] = ()
    world: World | None = None
    factors: Mapping[str, float] = field(default_factory=dict)
    shift: float = 0.03
    missing: tuple[str, ...] = ()

    def random(self, stream: int) -> np.random.Generator:
        """Return the random numbers of a stream."""
        return np.random.default_rng([*self.key, stream])

    @property
    def deviations(self) -> World:
        """The deviations of the bench other than effects."""
        return self.world or plain_world(self.bench)


def simulate(case: Case, relative: float = 1e-8) -> Run:
    """Run the case without noise."""
    random = case.random(_CONDITIONS)
    conditions = choose_conditions(case.count, case.bench, random)
    order = random.permutation(len(conditions))
    return observe(_engagements(case, conditions, order, random), conditions, order, relative)


def measure(case: Case, run: Run) -> tuple[np.ndarray, sensors.Signals]:
    """Return the measured shifting times (n,) in s and signals (n, k) of a run of the case."""
    random, world = case.random(_NOISE), case.deviations
    noisy = run.lock_time + world.time_noise * random.standard_normal(len(run.lock_time))
    times = np.maximum(np.round(noisy / TIME_STEP), 1) * TIME_STEP
    factor = np.where(second_batch(run.order), 1.3, 0.7)[:, None] if world.batches else 1.0
    signals = sensors.add_noise(run.readings, {name: world.noise[name] * factor for name in SENSORS}, world.memory,
                                random)
    bad_runs.corrupt(signals, case.bench.time, bad_runs_of(case, run.conditions))
    return times, signals


def measure_further(case: Case, run: Run) -> sensors.Signals:
    """Return the measured further channels (n, k) of a run of the case, by name, in °C."""
    random, shape = case.random(_THERMOMETER), (len(run.conditions), len(case.bench.time))
    return {name: (values[:, None] + READING * random.standard_normal(shape)).astype(np.float32)
            for name, values in run.engagements.channels.items()}


def bad_runs_of(case: Case, recorded: np.ndarray) -> tuple[bad_runs.BadRun, ...]:
    """Return the bad runs of a case among the `recorded` conditions (n,)."""
    drawn = _bad_runs(case, choose_conditions(case.count, case.bench, case.random(_CONDITIONS)))
    rows = {int(condition): row for row, condition in enumerate(recorded)}
    return tuple(replace(bad, run=rows[bad.condition]) for bad in drawn if bad.condition in rows)


def choose_runs(share: float, order: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return in which runs (n,) an effect acts: in all, or in a share of them, which follow each other or do not."""
    n = len(order)
    count = min(max(LEAST_RUNS, round(share * n)), n)
    first = random.integers(n - count + 1)
    follow = (order >= first) & (order < first + count)
    scattered = np.isin(np.arange(n), random.permutation(n)[:count])
    return follow if random.random() < 0.5 else scattered


def choose_conditions(count: int, bench: Bench, random: np.random.Generator) -> np.ndarray:
    """Return `count` conditions of a bench, with every level of every factor about equally often."""
    factors = (bench.profile, bench.motor_speed, bench.load_inertia, bench.brake_torque)
    levels = np.array([np.unique(factor, return_inverse=True)[1] for factor in factors])
    chosen: list[int] = []
    for _ in range(min(count, len(bench.profile))):
        used = sum(np.bincount(row[chosen], minlength=row.max() + 1)[row] * (row.max() + 1) for row in levels)
        used[chosen] = 10**6
        chosen.append(int(np.lexsort((random.random(len(used)), used))[0]))
    return np.sort(chosen)


def _bad_runs(case: Case, conditions: np.ndarray) -> tuple[bad_runs.BadRun, ...]:
    share = case.deviations.bad_runs
    return bad_runs.draw(conditions, share, case.bench, case.random(_BAD_RUNS)) if share else ()


def _engagements(case: Case, conditions: np.ndarray, order: np.ndarray, random: np.random.Generator) -> Engagements:
    n, bench, world, few = len(conditions), case.bench, case.deviations, case.random(_FEW)
    errors = case.random(_DEVIATIONS)
    actual = with_other_curves(bench, world.converter, errors)
    columns = bench.motor_speed, bench.load_inertia, bench.brake_torque
    levels = [with_errors(column, world.conditions, errors)[conditions] for column in columns]
    if world.batches:
        later = [with_errors(column, world.conditions, errors)[conditions] for column in columns]
        levels = [np.where(second_batch(order), *pair) for pair in zip(later, levels, strict=True)]
    sequence = order / max(n - 1, 1)
    ambient = 1 + world.ambient * (sequence - 0.5)
    levels = [level * factor for level, factor in zip(levels, (ambient, 1.0, ambient), strict=True)]
    effects = tuple(Acting(each.effect, each.amplitude, choose_runs(each.share, order, few)) for each in case.hidden)
    time, current = with_plays(effects, *(knots[bench.profile[conditions]] for knots in (
        bench.profile_time, bench.profile_current)))
    for bad in _bad_runs(case, conditions):
        if bad.kind == "valve sticks":
            time, current = _with_stuck_valve(time, current, np.flatnonzero(conditions == bad.condition)[0], bad)
    channels = {}
    if world.thermometer or any(each.effect.abscissa == "oil_temperature" for each in case.hidden):
        channels["oil_temperature"] = oil_temperature(order, case.random(_TEMPERATURE))
    return Engagements(actual, _values(case, order, random), *levels, sequence, time, current, effects, world.sag,
                       world.clocks, channels)


def with_plays(effects: tuple[Acting, ...], time: np.ndarray, current: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the knots (n, m) of the current after the plays of the valve."""
    for acting in effects:
        if acting.effect.plays is not None and acting.amplitude:
            widths, weights, asymmetry = acting.effect.plays
            up, down = (acting.amplitude * (1 + sign * asymmetry) * widths for sign in (1, -1))
            time, current = (play(time, current, float(up[0]), float(down[0])) if len(widths) == 1
                             else plays(time, current, up, down, weights))
    return time, current


def _values(case: Case, order: np.ndarray, random: np.random.Generator) -> dict[str, np.ndarray]:
    n, bench = len(order), case.bench
    shift = case.shift * np.clip(random.standard_normal(len(bench.uncertain)), -2.7, 2.7)
    factor = dict(zip(bench.uncertain, 1 + shift, strict=True))
    values = {name: np.full(n, value * factor.get(name, 1.0) * case.factors.get(name, 1.0))
              for name, value in bench.parameters.items()}
    for name, std in case.deviations.scatter.items():
        values[name] = values[name] * (1 + std * random.standard_normal(n))
    return values


def _with_stuck_valve(time: np.ndarray, current: np.ndarray, lane: int,
                      bad: bad_runs.BadRun) -> tuple[np.ndarray, np.ndarray]:
    time, current = (np.pad(knots, ((0, 0), (0, 3)), mode="edge") for knots in (time, current))
    time[lane], current[lane] = bad_runs.stick(time[lane, :-3], current[lane, :-3], bad.start, bad.duration)
    return time, current
