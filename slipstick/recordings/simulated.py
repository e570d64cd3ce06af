"""Recordings that the sensors of a bench would make of a model, whose parameters scatter from run to run.

A study or a calibration of them says beforehand what recordings of such a bench can show.
"""

from dataclasses import replace

import numpy as np

from slipstick.bench import Bench
from slipstick.bench.conditions import Conditions
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.signals import SIGNAL_UNITS

SIMULATED = "Simulated recordings"
"""How the description of such recordings begins: no others are replaced."""
_AFTER = 0.2
"""Time in s for which signals go on after the latest lock-up, as far as the current profiles do."""


def simulated_recordings(bench: Bench, model: Model, conditions: Conditions, scatter: float = 0.02, noise: float = 1.0,
                         seed: int = 0) -> Recordings:
    """One engagement of the `model` under each of the n `conditions`, in random order unless they have one.

    The parameters have the scatter that the bench states, as a share of their nominal values, and uncertain ones
    without one that of `scatter`. Signals have normal noise, so many times that of the bench's sensors, and their
    resolution. Raises `InvalidValue` for a bench without the noise of a sensor, for engagements that do not lock, and
    for a negative `scatter`, `noise` or `seed`.
    """
    if not (0 <= scatter < np.inf and 0 <= noise < np.inf):
        raise InvalidValue(f"The scatter is {scatter:g} and the noise {noise:g}", "Give numbers of 0 or more")
    if seed < 0:
        raise InvalidValue(f"The seed is {seed}", "Give a whole number of 0 or more")
    unknown = [name for name in SIGNAL_UNITS if bench.sensors[name].noise is None]
    if unknown:
        raise InvalidValue(f"The bench {bench.name} states no noise of {', '.join(unknown)}",
                           "Give it under [sensors] of the bench file")
    random, n = np.random.default_rng(seed), len(conditions)
    if conditions.run_order is None:
        conditions = replace(conditions, run_order=random.permutation(n))
    vectors = np.tile(model.parameters, (n, 1))
    for place, (nominal, prior) in enumerate(zip(bench.physics.nominal, bench.priors, strict=True)):
        share = prior.scatter if prior.scatter is not None else scatter if prior.uncertain else 0.0
        vectors[:, place] += share * nominal * random.standard_normal(n)
    coefficients = np.tile(model.coefficients(), (n, 1))
    lock = ensemble.simulate(model.converter, vectors, coefficients, conditions, paired=True,
                             laws=model.laws).shifting_time
    if failed := np.flatnonzero(np.isnan(lock)).tolist():
        raise InvalidValue(f"{len(failed)} of {n} engagements do not lock, the first under condition {failed[0]}",
                           "Check the bench (`bench check`), or take weaker effects and less scatter")
    ends = conditions.profile_time[conditions.current_profile, -1]
    time = np.arange(0.0, min(lock.max() + _AFTER, ends.min()), bench.sample_time)
    response = ensemble.simulate(model.converter, vectors, coefficients, conditions, time, paired=True, laws=model.laws)

    def read(name: str, true: np.ndarray) -> np.ndarray:
        sensor = bench.sensors[name]
        values = true + noise * (sensor.noise or 0.0) * random.standard_normal(true.shape)
        return np.round(values / sensor.resolution) * sensor.resolution if sensor.resolution else values

    signals = Signals(time, *(read(name, getattr(response, name)) for name in SIGNAL_UNITS))
    measured = np.clip(read("shifting_time", lock), bench.sample_time, ends)
    effects = ", ".join(model.effects) or "no effect"
    return Recordings(conditions, measured, signals, conditions.run_order,
                      f"{SIMULATED}: the bench {bench.name} with {effects}, scatter {scatter:g}, noise {noise:g}, "
                      f"seed {seed}")
