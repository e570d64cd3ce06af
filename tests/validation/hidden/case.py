"""A sealed case: hidden effects, a seed, and how far the bench is from nominal; its recordings and its truth."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from . import nominal, sensors
from .bench import Bench
from .catalogue import PHYSICAL, UNLISTED
from .run import Run, observe
from .valve import play

EFFECTS = {effect.name: effect for effect in (*PHYSICAL, *sensors.SENSORS, *UNLISTED)}
SCATTER = {"aa": 0.05, "x30": 0.08, "alpha": 0.005, "k": 0.005, "kT": 0.005}  # relative std from run to run
DRIFTING = ("aa", "x30")
TIME_NOISE, TIME_STEP = 0.3, 1e-4  # s of std for each unit of the noise share; s


@dataclass(frozen=True)
class Case:
    """What decides a set of recordings; the same case gives the same file.

    `effects` maps names in `EFFECTS` to strengths. `noise` is the std of every sensor's noise as a share of its
    signal's range over the recordings, and 0.3 s times it is that of the shifting time (3 ms at 0.01). `count` of
    the 216 conditions are run, every level of every factor about equally often. `shift`: how far the seven uncertain
    parameters are from nominal: a normal few percent (std 3 %, at most 8), 10 % up or down, or none. The run-to-run
    scatter `SCATTER` is multiplied by `scatter`; where it is `drifting`, that of `DRIFTING` creeps along the sequence.
    """

    effects: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    noise: float = 0.01
    count: int = 216
    signals: bool = True
    shift: Literal["few percent", "ten percent", "none"] = "few percent"
    scatter: float = 1.0
    drifting: bool = False


def simulate(case: Case, relative: float = 1e-8) -> Run:
    """Run the case without noise."""
    random = np.random.default_rng([case.seed, 1])
    conditions = _chosen(case.count, random)
    order = random.permutation(len(conditions))
    return observe(_bench(case, conditions, order, random), conditions, order, relative)


def generate(case: Case) -> tuple[Run, np.ndarray, sensors.Signals]:
    """Return the noiseless run, the measured shifting times (n,) in s, and the measured signals (n, k)."""
    run = simulate(case)
    random = np.random.default_rng([case.seed, 2])
    noisy = run.lock_time + TIME_NOISE * case.noise * random.standard_normal(len(run.lock_time))
    times = np.maximum(np.round(noisy / TIME_STEP), 1) * TIME_STEP
    return run, times, sensors.measured(run.readings, case.noise, random)


def _bench(case: Case, conditions: np.ndarray, order: np.ndarray, random: np.random.Generator) -> Bench:
    n = len(conditions)
    moved = random.standard_normal(len(nominal.UNCERTAIN))
    shift = {"few percent": np.clip(0.03 * moved, -0.08, 0.08), "ten percent": 0.1 * np.sign(moved), "none": 0 * moved}
    factor = dict(zip(nominal.UNCERTAIN, 1 + shift[case.shift], strict=True))
    values = {name: np.full(n, value * factor.get(name, 1.0)) for name, value in nominal.PARAMETERS.items()}
    for name, std in SCATTER.items():
        germ = random.standard_normal(n)
        if case.drifting and name in DRIFTING:
            germ = _creeping(germ)[order]
        values[name] = values[name] * (1 + case.scatter * std * germ)
    effects = tuple((EFFECTS[name], strength) for name, strength in case.effects.items() if strength)
    profile = nominal.PROFILE_TIME, nominal.PROFILE_CURRENT
    for effect, strength in effects:
        if effect.quantity == "valve_play":
            profile = play(*profile, effect.law(strength, 1), effect.law(strength, -1))
    time, current = (knots[nominal.PROFILE[conditions]] for knots in profile)
    return Bench(values, nominal.MOTOR_SPEED[conditions], nominal.LOAD_INERTIA[conditions],
                 nominal.BRAKE_TORQUE[conditions], order / max(n - 1, 1), time, current, effects)


def _creeping(germ: np.ndarray, memory: float = 0.95) -> np.ndarray:
    crept = germ.copy()
    for here in range(1, len(germ)):
        crept[here] = memory * crept[here - 1] + np.sqrt(1 - memory**2) * germ[here]
    return crept


def _chosen(count: int, random: np.random.Generator) -> np.ndarray:
    factors = (nominal.PROFILE, nominal.MOTOR_SPEED, nominal.LOAD_INERTIA, nominal.BRAKE_TORQUE)
    levels = np.array([np.unique(factor, return_inverse=True)[1] for factor in factors])
    chosen: list[int] = []
    for _ in range(count):
        used = sum(np.bincount(row[chosen], minlength=6)[row] * (row.max() + 1) for row in levels)
        used[chosen] = 10**6
        chosen.append(int(np.lexsort((random.random(len(used)), used))[0]))
    return np.sort(chosen)
