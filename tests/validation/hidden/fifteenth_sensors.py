"""Lags, offsets and gain errors of sensors of the list `overseas`; part of `FIFTEENTH` (fifteenth.py)."""

import numpy as np

from .fifteenth_shapes import bounces, gears, lull, packet, saddle
from .unseen_sensors import gain, lag, offset

FIFTEENTH_SENSORS = (
    # The gas behind the membrane is heated as it is compressed, presses back, and cools again
    lag("pressure_gas_behind_the_membrane_is_heated", "pressure", "warms", 0.025),
    # A ring of the wheel of the output hangs on a soft hub, and some of its teeth count with the others
    lag("output_speed_ring_hangs_on_a_soft_hub", "output_speed", "swings", 0.03),
    # The zero creeps, and is set at ever longer intervals
    offset("pressure_zero_is_set_ever_more_rarely", "pressure", "sequence", 0.3,
           lambda r: 0.2 + 1.2 * gears(np.maximum(r, 0) / 0.09 + 1, 2.2, 0.1)),
    # The bracket of the pickup is struck by the command, and bounces on its rubber
    offset("input_speed_bracket_bounces_on_its_rubber", "input_speed", "time", 2.5,
           lambda t: 0.1 + 1.3 * bounces(t, 0.08, 0.42, 0.7)),
    # A crane passes over the bench a few times around noon
    offset("torque_bridge_swings_as_a_crane_passes", "output_torque", "sequence", 15.0,
           lambda r: 0.3 + packet(r, 0.55, 0.24, 0.18)),
    # Two membranes in a row bulge, one below and one above the pressure at which they lie on each other
    gain("pressure_membranes_bulge_on_both_sides", "pressure", 0.06, lambda x: 0.6 * saddle(x, 0.4, 0.16)),
    # The wheel of the output rings about a speed
    gain("output_speed_wheel_rings_about_a_speed", "output_speed", 0.08, lambda x: 0.6 * packet(x, 0.34, 0.24, 0.18)),
    # The flange is held by a ring that is free in the middle of its play, and draws at both ends
    gain("torque_flange_is_held_by_a_loose_ring", "output_torque", 0.06,
         lambda x: 0.5 * np.sign(x) * lull(np.abs(x), 0.3, 0.13)),
)
