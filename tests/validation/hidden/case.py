"""A case: hidden effects, random seed, and deviations from the nominal bench; it determines the recordings."""

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
TIME_NOISE = 0.3  # s, std of the shifting-time noise per unit of `Case.noise`
TIME_STEP = 1e-4  # s, resolution of the shifting times


@dataclass(frozen=True)
class Case:
    """The specification of a set of recordings; equal cases give identical files.

    `effects` maps names in `EFFECTS` to strengths. `noise` is the noise std of every sensor as a fraction of the range
    of its signal; the noise std of the shifting time is 0.3 s times `noise` (3 ms at 0.01). `count` of the 216
    conditions are run, with every level of every factor about equally often. `shift` is the deviation of the seven
    uncertain parameters from nominal: normal with a std of 3 %, clipped to 8 %; 10 % up or down; or none. The
    run-to-run scatter `SCATTER` is multiplied by `scatter`. If `drifting`, the scatter of the parameters `DRIFTING` is
    autocorrelated along the test sequence.
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
    conditions = _balanced_conditions(case.count, random)
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
    normals = random.standard_normal(len(nominal.UNCERTAIN))
    shift = {"few percent": np.clip(0.03 * normals, -0.08, 0.08), "ten percent": 0.1 * np.sign(normals),
             "none": 0 * normals}
    factor = dict(zip(nominal.UNCERTAIN, 1 + shift[case.shift], strict=True))
    values = {name: np.full(n, value * factor.get(name, 1.0)) for name, value in nominal.PARAMETERS.items()}
    for name, std in SCATTER.items():
        normals = random.standard_normal(n)
        if case.drifting and name in DRIFTING:
            normals = _autocorrelated(normals)[order]
        values[name] = values[name] * (1 + case.scatter * std * normals)
    effects = tuple((EFFECTS[name], strength) for name, strength in case.effects.items() if strength)
    profile = nominal.PROFILE_TIME, nominal.PROFILE_CURRENT
    for effect, strength in effects:
        if effect.quantity == "valve_play":
            profile = play(*profile, effect.law(strength, 1), effect.law(strength, -1))
    time, current = (knots[nominal.PROFILE[conditions]] for knots in profile)
    return Bench(values, nominal.MOTOR_SPEED[conditions], nominal.LOAD_INERTIA[conditions],
                 nominal.BRAKE_TORQUE[conditions], order / max(n - 1, 1), time, current, effects)


def _autocorrelated(normals: np.ndarray, correlation: float = 0.95) -> np.ndarray:
    process = normals.copy()
    for i in range(1, len(normals)):
        process[i] = correlation * process[i - 1] + np.sqrt(1 - correlation**2) * normals[i]
    return process


def _balanced_conditions(count: int, random: np.random.Generator) -> np.ndarray:
    factors = (nominal.PROFILE, nominal.MOTOR_SPEED, nominal.LOAD_INERTIA, nominal.BRAKE_TORQUE)
    levels = np.array([np.unique(factor, return_inverse=True)[1] for factor in factors])
    chosen: list[int] = []
    for _ in range(count):
        used = sum(np.bincount(row[chosen], minlength=6)[row] * (row.max() + 1) for row in levels)
        used[chosen] = 10**6
        chosen.append(int(np.lexsort((random.random(len(used)), used))[0]))
    return np.sort(chosen)
