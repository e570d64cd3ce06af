"""Lags, offsets and gain errors of sensors of the list `outlying`; part of `THIRTEENTH` (thirteenth.py)."""

import numpy as np

from .tenth_shapes import shelf
from .thirteenth_shapes import stairs
from .twelfth_shapes import ramp, swing
from .unseen_sensors import gain, lag, offset

THIRTEENTH_SENSORS = (
    # The port was filled with a paste that creeps under a small pressure, and flows under a larger one
    lag("pressure_port_is_filled_with_a_paste", "pressure", "paste", 0.008),
    # The output speed is sent over a bus when it has changed by a share of itself
    lag("output_speed_is_sent_on_a_change_by_a_share", "output_speed", "share", 0.015),
    # A lamp near the sensor is on during a part of the runs
    offset("pressure_sensor_is_lit_for_some_runs", "pressure", "sequence", 0.3,
           lambda r: 0.2 + 1.2 * shelf(r, 0.27, 0.64, 0.08)),
    # The supply of the pickup sags as the engagement goes on, down to the lowest voltage of its regulator
    offset("input_speed_supply_sags_to_its_regulator", "input_speed", "time", 2.0,
           lambda t: 0.1 + 1.3 * ramp(t, 0.12, 0.6)),
    # The flange was taken off and bolted on again several times, each time with another preload
    offset("torque_flange_is_bolted_on_anew", "output_torque", "sequence", 15.0,
           lambda r: 0.2 + stairs(r, (0.17, 1.0), (0.36, 0.3), (0.62, 1.2), (0.85, -0.5))),
    # A small bubble in the port gives way at low pressures
    gain("pressure_port_holds_a_small_bubble", "pressure", 0.06,
         lambda x: 0.25 * np.sign(x) * np.log1p(np.abs(x) / 0.05)),
    # Two timers with different quartzes take over from each other
    gain("output_speed_timers_take_over", "output_speed", 0.06, lambda x: 0.5 * swing(x, 0.38, 0.13)),
    # The webs of the measuring flange are drawn tight as they bend
    gain("torque_flange_webs_are_drawn_tight", "output_torque", 0.06,
         lambda x: -0.5 * np.sign(x) * np.minimum(np.abs(x) / 0.6, 2) ** 3),
)
