"""Lags, offsets and gain errors of sensors of the list `elsewhere`; part of `FOURTH` (fourth.py)."""

import numpy as np

from .unseen_sensors import gain, lag, offset

FOURTH_SENSORS = (
    lag("pressure_rises_late", "pressure", "rise", 0.015),
    lag("input_speed_is_averaged", "input_speed", "average", 0.02),
    lag("torque_rises_late", "output_torque", "rise", 0.015),
    offset("pressure_zero_is_shocked", "pressure", "sequence", 0.25,
           lambda r: 0.55 + np.where(r < 0.3, 0, 0.8 * np.exp(-(np.maximum(r, 0.3) - 0.3) / 0.18))),
    offset("output_speed_picks_up_hum", "output_speed", "output_speed", 1.0,
           lambda w: 1 / (1 + (np.maximum(w, 0) / 3) ** 2)),
    offset("torque_zero_swings", "output_torque", "sequence", 15.0, lambda r: 0.8 + 0.35 * np.sin(2 * np.pi * r)),
    gain("pressure_sensor_bends_back", "pressure", 0.06, lambda x: x * (1 - 0.9 * np.minimum(x * x, 1))),
    gain("input_speed_scale_is_curved", "input_speed", 0.03, lambda x: 0.6 * np.log1p(3 * np.maximum(x, 0))),
    gain("torque_bridge_is_stiff_at_first", "output_torque", 0.06,
         lambda x: np.sign(x) * (0.15 * np.abs(x) + 1.1 * np.maximum(np.abs(x) - 0.12, 0) ** 1.3)),
)
