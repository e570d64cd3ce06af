"""Unseen lags, offsets and gain errors of the four sensors; part of `UNSEEN` (unseen.py)."""

import numpy as np

from .effect import Effect

_FULL = {"pressure": 14.0, "input_speed": 200.0, "output_speed": 60.0, "output_torque": 800.0}
_UNITS = {"pressure": "bar", "input_speed": "rad/s", "output_speed": "rad/s", "output_torque": "N m"}
_BLOCKS = {"pressure": "pressure", "input_speed": "input speed", "output_speed": "output speed",
           "output_torque": "torque"}


def lag(name: str, sensor: str, response: str, typical: float) -> Effect:
    return Effect(name, _BLOCKS[sensor], f"{sensor}_sensor_{response}", "sequence", "difference", "s", typical,
                  lambda s, r: s + 0 * r, (f"{sensor.replace('_', ' ')} sensor", "lag"))


def offset(name: str, sensor: str, abscissa: str, typical: float, shape) -> Effect:
    return Effect(name, _BLOCKS[sensor], f"{sensor}_sensor", abscissa, "difference", _UNITS[sensor], typical,
                  lambda s, x: s * shape(x), (f"{sensor.replace('_', ' ')} sensor", "offset"))


def gain(name: str, sensor: str, typical: float, shape) -> Effect:
    full = _FULL[sensor]
    return Effect(name, _BLOCKS[sensor], f"{sensor}_sensor", sensor, "difference", "1", typical,
                  lambda s, x: s * full * shape(x / full), (f"{sensor.replace('_', ' ')} sensor", "gain"))


UNSEEN_SENSORS = (
    lag("pressure_comes_late", "pressure", "delay", 0.008),
    lag("pressure_line_rings", "pressure", "ring", 0.008),
    lag("input_pulses_are_filtered", "input_speed", "ring", 0.012),
    lag("output_pulses_are_counted", "output_speed", "count", 0.012),
    lag("torque_bus_is_late", "output_torque", "delay", 0.006),
    lag("torque_amplifier_is_slow", "output_torque", "slew", 0.004),
    offset("pressure_zero_warms", "pressure", "sequence", 0.25, lambda r: 1.15 - 0.4 * np.exp(-r / 0.2)),
    offset("input_speed_zero", "input_speed", "sequence", 1.5, lambda r: 0.9 + 0.15 * np.sqrt(r)),
    offset("output_pulses_are_lost", "output_speed", "output_speed", 0.5, lambda w: -np.tanh(np.maximum(w, 0) / 4)),
    offset("torque_zero_creeps", "output_torque", "sequence", 15.0, lambda r: -0.75 - 0.4 * r**1.5),
    gain("pressure_sensor_saturates", "pressure", 0.06, lambda x: -np.sign(x) * np.abs(x) ** 2.2),
    gain("pressure_sensor_bends", "pressure", 0.05, lambda x: x + 0.5 * np.sin(np.pi * np.clip(x, -1, 1)) / np.pi),
    gain("input_speed_scale", "input_speed", 0.025, lambda x: x * (0.7 + 0.5 * x)),
    gain("output_speed_scale", "output_speed", 0.025, lambda x: -np.maximum(x, 0) ** 0.8),
    gain("torque_bridge_saturates", "output_torque", 0.07, lambda x: -x * np.abs(x) / (0.5 + np.abs(x))),
    gain("torque_bridge_amplifies", "output_torque", 0.04, lambda x: np.where(x > 0.3, x - 0.15, 0.5 * x)),
)
