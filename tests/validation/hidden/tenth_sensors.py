"""Lags, offsets and gain errors of sensors of the list `afield`; part of `TENTH` (tenth.py)."""

import numpy as np

from .ninth_shapes import burr, hump
from .seventh_waves import skewed
from .tenth_shapes import scallops, shelf, warmed
from .unseen_sensors import gain, lag, offset

TENTH_SENSORS = (
    lag("pressure_transmitter_wakes_up", "pressure", "wake", 0.008),
    lag("output_speed_is_timed_from_tooth_to_tooth", "output_speed", "tooth", 0.015),
    offset("pressure_zero_follows_the_days", "pressure", "sequence", 0.3,
           lambda r: 0.2 + 1.2 * scallops(r + 0.1, 0.43)),
    offset("input_speed_gate_drifts_against_the_teeth", "input_speed", "time", 2.0,
           lambda t: 0.4 + 0.8 * skewed(t / 0.5, 0.9)),
    offset("torque_bridge_stands_in_the_sun", "output_torque", "sequence", 15.0,
           lambda r: 0.15 + 1.5 * warmed(r, 0.2, 0.55, 0.12, 0.15)),
    gain("pressure_amplifier_has_a_middle_range", "pressure", 0.06, lambda x: 0.6 * shelf(x, 0.25, 0.6, 0.16)),
    gain("output_speed_converter_locks_on_late", "output_speed", 0.08, lambda x: 0.7 * burr(x, 0.13, 0.02, 0.3)),
    gain("torque_flange_slips_and_grips", "output_torque", 0.06, lambda x: 0.5 * np.sign(x) * hump(np.abs(x), 0.22, 2)),
)
