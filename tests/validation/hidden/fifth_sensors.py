"""Lags, offsets and gain errors of sensors of the list `fresh`; part of `FIFTH` (fifth.py)."""

import numpy as np

from .unseen_sensors import gain, lag, offset

FIFTH_SENSORS = (
    lag("pressure_line_carries_and_smooths", "pressure", "carry", 0.01),
    lag("input_speed_is_weighted", "input_speed", "window", 0.025),
    lag("output_speed_takes_more_pulses_at_speed", "output_speed", "strain", 0.012),
    lag("load_cell_creeps_after", "output_torque", "creep", 0.025),
    offset("pressure_zero_falls_and_rises", "pressure", "sequence", 0.25, lambda r: 0.35 + 1.3 * np.abs(2 * r - 1)),
    offset("input_speed_zero_arches", "input_speed", "sequence", 1.5,
           lambda r: 0.2 + 2.2 * np.sqrt(np.maximum(r * (1 - r), 0))),
    offset("output_speed_zero_beats", "output_speed", "time", 0.6, lambda t: 0.4 + 0.8 * np.cos(2 * np.pi * t / 0.9)),
    offset("torque_zero_overshoots", "output_torque", "sequence", 15.0,
           lambda r: 2.4 * (r / 0.2) / (1 + (r / 0.2) ** 2) - 0.3),
    gain("pressure_sensor_waves", "pressure", 0.05, lambda x: 0.4 * x + 0.3 * np.sin(2 * np.pi * x / 0.8)),
    gain("input_speed_scale_changes_sign", "input_speed", 0.03, lambda x: 2.2 * x * (x - 0.45)),
    gain("output_speed_scale_turns_back", "output_speed", 0.05, lambda x: np.abs(x - 0.3) - 0.3),
    gain("torque_bridge_turns_back", "output_torque", 0.06, lambda x: x * np.cos(2.4 * x)),
)
