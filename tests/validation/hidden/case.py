"""A case: hidden effects, random seed, and deviations from the nominal bench; it determines the recordings."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from . import bad_runs, sensors
from .bench import Bench
from .catalogue import PHYSICAL, UNLISTED
from .forms import FORMS
from .nominal import SETUPS, Setup
from .run import Run, observe
from .temptations import READING, oil_temperature, second_batch
from .valve import play, plays
from .world import World, draw, with_errors, with_other_curves

EFFECTS = {effect.name: effect for effect in (*PHYSICAL, *sensors.SENSORS, *UNLISTED)}
LAWS = EFFECTS | {effect.name: effect for effects in FORMS.values() for effect in effects}
PLAYS = np.linspace(0.1, 1.0, 7)  # fractions that number the plays of a valve with several
SCATTER = {"aa": 0.05, "x30": 0.08, "alpha": 0.005, "k": 0.005, "kT": 0.005}  # relative std from run to run
DRIFTING = ("aa", "x30")
TIME_NOISE = 0.3  # s, std of the shifting-time noise per unit of `Case.noise`
TIME_STEP = 1e-4  # s, resolution of the shifting times


@dataclass(frozen=True)
class Case:
    """The specification of a set of recordings; equal cases give identical files.

    `effects` maps names in `LAWS` to strengths. `noise` is the noise std of every sensor as a fraction of the range
    of its signal; the noise std of the shifting time is 0.3 s times `noise` (3 ms at 0.01). `count` of the conditions
    of the bench are run, with every level of every factor about equally often. `shift` is the deviation of the seven
    uncertain parameters from nominal: normal with a std of 3 %, clipped to 8 %; 10 % up or down; or none. The
    run-to-run scatter `SCATTER` is multiplied by `scatter`. If `drifting`, the scatter of the parameters `DRIFTING` is
    autocorrelated along the test sequence. `world` adds further deviations of the bench, "any" all of them,
    drawn from the seed; its scatter and its noise take the place of the ones above.
    """

    effects: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    noise: float = 0.01
    count: int = 216
    signals: bool = True
    shift: Literal["few percent", "ten percent", "none"] = "few percent"
    scatter: float = 1.0
    drifting: bool = False
    bench: str = "heavy"
    world: World | Literal["any"] | None = None

    @property
    def setup(self) -> Setup:
        """The nominal bench."""
        return SETUPS[self.bench]

    @cached_property
    def drawn_world(self) -> World:
        """The world, drawn if it is "any"."""
        if self.world == "any":
            return draw(self.seed, self.setup)
        return self.world or World()


def simulate(case: Case, relative: float = 1e-8) -> Run:
    """Run the case without noise."""
    random = np.random.default_rng([case.seed, 1])
    conditions = _balanced_conditions(case.count, case.setup, random)
    order = random.permutation(len(conditions))
    return observe(_bench(case, conditions, order, random), conditions, order, relative)


def generate(case: Case, relative: float = 1e-8) -> tuple[Run, np.ndarray, sensors.Signals]:
    """Return the noiseless run, the measured shifting times (n,) in s, and the measured signals (n, k)."""
    run = simulate(case, relative)
    random = np.random.default_rng([case.seed, 2])
    world = case.drawn_world
    std = TIME_NOISE * case.noise if world.time_noise is None else world.time_noise
    noisy = run.lock_time + std * random.standard_normal(len(run.lock_time))
    times = np.maximum(np.round(noisy / TIME_STEP), 1) * TIME_STEP
    noise = dict.fromkeys(run.readings, case.noise) if world.noise is None else world.noise
    memory = dict.fromkeys(run.readings, sensors.NOISE_MEMORY) if world.memory is None else world.memory
    if world.batches:
        factor = np.where(second_batch(run.order), 1.3, 0.7)[:, None]
        noise = {name: std * factor for name, std in noise.items()}
    signals = sensors.measured(run.readings, noise, memory, random)
    bad_runs.corrupt(signals, case.setup.time, bad_runs_of(case, run.conditions))
    return run, times, signals


def further(case: Case, run: Run) -> sensors.Signals:
    """Return the measured further channels (n, k) of a run of the case, by name, in °C."""
    random = np.random.default_rng([case.seed, 8])
    shape = len(run.conditions), len(case.setup.time)
    return {name: (values[:, None] + READING * random.standard_normal(shape)).astype(np.float32)
            for name, values in run.bench.channels.items()}


def bad_runs_of(case: Case, recorded: np.ndarray) -> tuple[bad_runs.BadRun, ...]:
    """Return the bad runs of a case among the `recorded` conditions (n,)."""
    random = np.random.default_rng([case.seed, 1])
    drawn = _bad_runs(case, _balanced_conditions(case.count, case.setup, random))
    rows = {int(condition): row for row, condition in enumerate(recorded)}
    return tuple(replace(bad, run=rows[bad.condition]) for bad in drawn if bad.condition in rows)


def _bad_runs(case: Case, conditions: np.ndarray) -> tuple[bad_runs.BadRun, ...]:
    share = case.drawn_world.bad_runs
    return bad_runs.draw(conditions, share, case.setup, np.random.default_rng([case.seed, 4])) if share else ()


def _bench(case: Case, conditions: np.ndarray, order: np.ndarray, random: np.random.Generator) -> Bench:
    n, setup, world = len(conditions), case.setup, case.drawn_world
    errors = np.random.default_rng([case.seed, 5])
    actual = with_other_curves(setup, world.converter, errors)
    columns = setup.motor_speed, setup.load_inertia, setup.brake_torque
    levels = [with_errors(column, world.conditions, errors)[conditions] for column in columns]
    if world.batches:
        later = [with_errors(column, world.conditions, errors)[conditions] for column in columns]
        levels = [np.where(second_batch(order), *pair) for pair in zip(later, levels, strict=True)]
    sequence = order / max(n - 1, 1)
    ambient = 1 + world.ambient * (sequence - 0.5)
    levels = [level * factor for level, factor in zip(levels, (ambient, 1.0, ambient), strict=True)]
    effects = tuple((LAWS[name], strength) for name, strength in case.effects.items() if strength)
    profile = setup.profile_time, setup.profile_current
    for effect, strength in effects:
        if effect.quantity == "valve_play":
            width = setup.scale.get("valve_current", 1.0)
            profile = play(*profile, width * effect.law(strength, 1), width * effect.law(strength, -1))
        elif effect.quantity == "valve_plays":
            profile = plays(*profile, setup.scale.get("valve_current", 1.0) * effect.law(strength, PLAYS))
    time, current = (knots[setup.profile[conditions]] for knots in profile)
    for bad in _bad_runs(case, conditions):
        if bad.kind == "valve sticks":
            time, current = _with_stuck_valve(time, current, np.flatnonzero(conditions == bad.condition)[0], bad)
    return Bench(_values(case, order, random), *levels, sequence, time, current, effects, actual,
                 world.sag, world.clocks, _channels(case, order))


def _channels(case: Case, order: np.ndarray) -> dict[str, np.ndarray]:
    needed = any(LAWS[name].abscissa == "oil_temperature" for name in case.effects)
    if not (needed or case.drawn_world.thermometer):
        return {}
    return {"oil_temperature": oil_temperature(order, np.random.default_rng([case.seed, 7]))}


def _values(case: Case, order: np.ndarray, random: np.random.Generator) -> dict[str, np.ndarray]:
    n, setup, scatter = len(order), case.setup, case.drawn_world.scatter
    normals = random.standard_normal(len(setup.uncertain))
    shift = {"few percent": np.clip(0.03 * normals, -0.08, 0.08), "ten percent": 0.1 * np.sign(normals),
             "none": 0 * normals}
    factor = dict(zip(setup.uncertain, 1 + shift[case.shift], strict=True))
    values = {name: np.full(n, value * factor.get(name, 1.0)) for name, value in setup.parameters.items()}
    for name, std in (SCATTER if scatter is None else scatter).items():
        normals = random.standard_normal(n)
        if case.drifting and name in DRIFTING:
            normals = _autocorrelated(normals)[order]
        values[name] = values[name] * (1 + case.scatter * std * normals)
    return values


def _with_stuck_valve(time: np.ndarray, current: np.ndarray, lane: int,
                      bad: bad_runs.BadRun) -> tuple[np.ndarray, np.ndarray]:
    time, current = (np.pad(knots, ((0, 0), (0, 3)), mode="edge") for knots in (time, current))
    time[lane], current[lane] = bad_runs.stick(time[lane, :-3], current[lane, :-3], bad.start, bad.duration)
    return time, current


def _autocorrelated(normals: np.ndarray, correlation: float = 0.95) -> np.ndarray:
    process = normals.copy()
    for i in range(1, len(normals)):
        process[i] = correlation * process[i - 1] + np.sqrt(1 - correlation**2) * normals[i]
    return process


def _balanced_conditions(count: int, setup: Setup, random: np.random.Generator) -> np.ndarray:
    factors = (setup.profile, setup.motor_speed, setup.load_inertia, setup.brake_torque)
    levels = np.array([np.unique(factor, return_inverse=True)[1] for factor in factors])
    chosen: list[int] = []
    for _ in range(min(count, len(setup.profile))):
        used = sum(np.bincount(row[chosen], minlength=6)[row] * (row.max() + 1) for row in levels)
        used[chosen] = 10**6
        chosen.append(int(np.lexsort((random.random(len(used)), used))[0]))
    return np.sort(chosen)
