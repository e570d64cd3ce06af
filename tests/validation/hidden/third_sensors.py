"""Lags, offsets and gain errors of sensors of the list `unseen`; part of `THIRD` (third.py)."""

import numpy as np

from .unseen_sensors import gain, lag, offset

THIRD_SENSORS = (
    lag("pressure_falls_late", "pressure", "fall", 0.025),
    lag("output_speed_is_held", "output_speed", "hold", 0.03),
    lag("torque_falls_late", "output_torque", "fall", 0.015),
    offset("pressure_zero_jumps", "pressure", "sequence", 0.25, lambda r: np.where(r < 0.45, 0.8, 1.2)),
    offset("input_speed_zero_settles", "input_speed", "time", 1.5, lambda t: 1 - 0.8 * np.exp(-t / 0.35)),
    offset("torque_zero_is_set_twice", "output_torque", "sequence", 15.0,
           lambda r: np.where((r > 0.3) & (r < 0.7), -1.3, -0.8)),
    gain("pressure_sensor_has_a_kink", "pressure", 0.08, lambda x: np.maximum(x, 0) - 2 * np.maximum(x - 0.4, 0)),
    gain("output_speed_loses_teeth", "output_speed", 0.04, lambda x: -x * 0.5 * (1 + np.tanh((x - 0.45) / 0.05))),
    gain("torque_bridge_changes_its_range", "output_torque", 0.06,
         lambda x: x * (1 - 1.3 * 0.5 * (1 + np.tanh((x - 0.55) / 0.03)))),
)
