"""Lags, offsets and gain errors of sensors of the list `abroad`; part of `NINTH` (ninth.py)."""

import numpy as np

from .ninth_shapes import hinge, hump
from .unseen_sensors import gain, lag, offset

NINTH_SENSORS = (
    lag("pressure_port_is_full_of_grease", "pressure", "slip", 0.01),
    lag("output_speed_recorder_has_a_slow_clock", "output_speed", "clock", 0.012),
    offset("pressure_zero_drifts_from_some_run_on", "pressure", "sequence", 0.3,
           lambda r: 0.3 + 2.6 * hinge(r, 0.55, 0.05)),
    offset("input_speed_zero_jumps_as_the_valve_draws", "input_speed", "time", 3.0,
           lambda t: 0.25 + 1.2 * hump(t, 0.16, 1.6)),
    gain("pressure_amplifier_runs_into_its_supply", "pressure", 0.08, lambda x: -1.6 * hinge(x, 0.5, 0.04)),
    gain("torque_shaft_bush_takes_its_part", "output_torque", 0.06, lambda x: -0.5 * np.sign(x) * np.abs(x) ** 0.35),
)
