"""Measured laws of sensors: they change what a sensor reads, after integration and after all effects on it."""

from collections.abc import Iterable, Mapping

import numpy as np

from slipstick.bench.conditions import Conditions
from slipstick.clutch.laws import MeasuredLaw


def with_sensor_laws(readings: Mapping[str, np.ndarray], true: Mapping[str, np.ndarray], laws: Iterable[MeasuredLaw],
                     sample_times: np.ndarray, conditions: Conditions) -> dict[str, np.ndarray]:
    """The `readings` of all signals (..., n, k) under n conditions at `sample_times` (k,) in s, with those of `laws`
    that are of sensors.

    A law depends on the `true` signals (..., n, k), on the time, or on what the conditions state.
    """
    changed = dict(readings)
    order = np.zeros(len(conditions)) if conditions.run_order is None else conditions.run_order
    known = {"time": sample_times, "motor speed": conditions.motor_speed[:, None], "run order": order[:, None],
             **{name.replace("_", " "): signal for name, signal in true.items()}}
    for law in (law for law in laws if law.of_sensor):
        name = law.quantity.removesuffix(" sensor").replace(" ", "_")
        change = np.interp(known[law.depends_on], law.at, law.change)
        changed[name] = changed[name] * (1 + change) if law.relative else changed[name] + change
    return changed
