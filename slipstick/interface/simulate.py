"""`slipstick.simulate`: recordings that the sensors of a bench would make of a model."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import gcd
from numbers import Real
from typing import overload

import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.building import compile_simulator, say_compilation
from slipstick.clutch import effects as catalogue
from slipstick.clutch.effects.effect import Effect
from slipstick.engine.simulation import simulate_runs
from slipstick.errors import InvalidValue, UnknownName, require_whole, within_memory
from slipstick.interface.models import BenchLike, ModelLike, bench_of, conditions_of, model_of
from slipstick.machine import Machine, Runs, list_experiments
from slipstick.numerics.quantities import raised
from slipstick.recordings import Recordings
from slipstick.recordings.simulated import simulated_recordings

Effects = str | Iterable[str] | Mapping[str, float | Mapping[str, float]]
"""Names of effects, or effect -> multiple of its typical amplitudes, or effect -> coefficient -> value."""
SCATTER, NOISE = 0.02, 1.0
"""The usual scatter of a bench, and the usual multiple of the noise of its sensors."""


@overload
def simulate(bench: BenchLike, effects: Effects = (), *, model: ModelLike | None = None,
             conditions: Conditions | Recordings | None = None, engagements: int | None = None,
             scatter: float = SCATTER, noise: float = NOISE, seed: int = 0) -> Recordings: ...
@overload
def simulate(bench: Machine, *, seed: int = 0, runs: int | None = None) -> Runs: ...
@within_memory()
def simulate(bench: BenchLike | Machine, effects: Effects = (), *, model: ModelLike | None = None,
             conditions: Conditions | Recordings | None = None, engagements: int | None = None,
             scatter: float = SCATTER, noise: float = NOISE, seed: int = 0,
             runs: int | None = None) -> Recordings | Runs:
    """Simulate recordings of a bench, with sensor noise and scatter of the parameters from run to run.

    A study of them says beforehand what recordings of such a bench can show.

    Parameters
    ----------
    bench : Bench or Machine
        A bench, or a declared machine, whose experiments are simulated with its scatter and noise.
    effects : str, iterable of str, or mapping, optional
        Effects of the catalogue to add to the model: names, at their typical coefficients; or a mapping of names to
        multiples of the typical amplitudes, or to coefficients with their values, of which others are neutral.
    model : Model, result or path, optional
        The model to simulate: a `Model`, a result that has one, or a JSON file of either. By default that with the
        nominal parameters of the bench.
    conditions : Conditions or Recordings, optional
        The conditions to simulate, or recordings made under them; by default those of the bench.
    engagements : int, optional
        Number of engagements, evenly over the conditions, or each more than once. By default each condition once.
    scatter : float, optional
        Standard deviation from run to run of uncertain parameters for which the bench states none, as a share of their
        nominal values.
    noise : float, optional
        Noise as a multiple of that of the sensors of the bench.
    seed : int, optional
        Seed of all random numbers.
    runs : int, optional
        Number of runs of a declared machine: its experiments in turn. By default each once.

    Returns
    -------
    Recordings
        Or `Runs`, of a declared machine. With all signals, and in a random run order unless the conditions have one.

    Raises
    ------
    InvalidValue
        For numbers out of range, a bench without the noise of a sensor, engagements that do not lock, and what has no
        meaning for a declared machine, or for a bench.
    UnknownName
        For an effect or coefficient that does not exist.

    """
    require_whole(engagements=engagements, runs=runs, seed=seed)
    if isinstance(bench, Machine):
        given = {"effects": bool(effects), "model": model is not None, "conditions": conditions is not None,
                 "engagements": engagements is not None, "scatter": scatter != SCATTER, "noise": noise != NOISE}
        if any(given.values()):
            raise InvalidValue(f"{next(name for name in given if given[name])} is about a bench, not about a declared "
                               "machine", "Leave it out")
        experiments = list_experiments(bench)
        rows = np.arange(len(experiments) if runs is None else _require_count(runs, "runs")) % len(experiments)
        with say_compilation():
            return simulate_runs(bench, experiments.take(rows), seed=seed)
    if runs is not None:
        raise InvalidValue("runs is about a declared machine, not about a bench", "Give the number of engagements")
    bench = bench_of(bench)
    simulated, taken = model_of(bench, model), conditions_of(bench, conditions)
    for name, amount in _amounts(effects).items():
        simulated = simulated.with_effect(name, _coefficients(catalogue.find(name).on(bench.scales), amount))
    if engagements is not None:
        taken = _spread(taken, engagements)
    compile_simulator(simulated, taken)
    return simulated_recordings(bench, simulated, taken, scatter, noise, seed)


def _amounts(effects: Effects) -> Mapping[str, float | Mapping[str, float]]:
    if isinstance(effects, Mapping):
        return effects
    return dict.fromkeys([effects] if isinstance(effects, str) else effects, 1.0)


def _coefficients(effect: Effect, amount: float | Mapping[str, float]) -> dict[str, float]:
    """The coefficients of an effect at a multiple of its typical amplitudes, or those given and neutral others."""
    if isinstance(amount, Mapping):
        names = [entry.name for entry in effect.coefficients]
        for name in amount:
            if name not in names:
                raise UnknownName.of(f"coefficient of {effect.name}", name, names)
        values, how = {name: float(value) for name, value in amount.items()}, "The coefficient"
    elif isinstance(amount, Real) and not isinstance(amount, bool):
        values = {entry.name: entry.typical if entry.shape else
                  entry.neutral + float(amount) * (entry.typical - entry.neutral) for entry in effect.coefficients}
        how = f"At {amount:g} times its typical value, the coefficient"
    else:
        raise InvalidValue(f"The effect {effect.name} is {amount!r}",
                           "Give a multiple of its typical amplitudes, or a mapping of its coefficients to values")
    for entry in effect.coefficients:
        if entry.name in values and not entry.lower <= values[entry.name] <= entry.upper:
            unit = "" if entry.unit == "1" else f" {raised(entry.unit)}"
            raise InvalidValue(f"{how} {entry.name} of {effect.name} is {values[entry.name]:g}{unit}",
                               f"Take it between {entry.lower:g} and {entry.upper:g}{unit}")
    return values


def _spread(conditions: Conditions, engagements: int) -> Conditions:
    """So many conditions, evenly over those given, or each of them more than once."""
    many = len(conditions)
    rows = np.arange(_require_count(engagements, "engagements"))
    if engagements < many:
        # Equal steps would often meet a single level of the condition that varies fastest. A stride that has no factor
        # in common with the number of conditions, near its golden section, meets all levels about equally often.
        strides = (step for step in range(1, many) if gcd(step, many) == 1)
        stride = min(strides, key=lambda step: abs(step - 0.618 * many))
        rows = np.sort(rows * stride % many)
    return replace(conditions, run_order=None).take(rows % many)


def _require_count(count: int, what: str) -> int:
    if count < 1:
        raise InvalidValue(f"{count} {what} are too few", "Give 1 or more")
    return count
