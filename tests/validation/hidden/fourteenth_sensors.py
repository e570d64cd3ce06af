"""Lags, offsets and gain errors of sensors of the list `distant`; part of `FOURTEENTH` (fourteenth.py)."""

import numpy as np

from .eleventh_shapes import settling
from .fourteenth_shapes import teeth
from .tenth_shapes import crest, shelf
from .thirteenth_shapes import treads
from .twelfth_shapes import swing
from .unseen_sensors import gain, lag, offset

FOURTEENTH_SENSORS = (
    # The resin behind the membrane yields under each new load, over decades of time
    lag("pressure_membrane_lies_on_a_resin_that_yields", "pressure", "relax", 0.025),
    # The filter of the output speed starts anew with each recording, narrow at first and ever wider
    lag("output_speed_filter_opens_after_the_command", "output_speed", "opens", 0.025),
    # The supply of the sensor was exchanged, and its controller hunts before it comes to rest
    offset("pressure_supply_hunts_after_its_exchange", "pressure", "sequence", 0.3,
           lambda r: 0.2 + settling(r, 0.26, 0.36, 0.4)),
    # The pump on the same supply draws less and then more than before as it takes up its load
    offset("input_speed_supply_swings_as_the_pump_is_loaded", "input_speed", "time", 2.5,
           lambda t: 0.3 + 0.9 * swing(t, 0.42, 0.14)),
    # The bolts of the flange creep in two hot sessions, and rest in the cold ones in between
    offset("torque_flange_bolts_creep_in_two_hot_sessions", "output_torque", "sequence", 15.0,
           lambda r: 0.2 + treads(r, (0.16, 0.34, 0.7), (0.63, 0.78, 0.8))),
    # A grain under the membrane is pressed in until it is crushed
    gain("pressure_membrane_presses_a_grain_until_it_breaks", "pressure", 0.06,
         lambda x: -0.6 * crest(x, 0.42, 0.2, 0.06)),
    # The wheel of the output shakes between two speeds, where some of its teeth are counted twice
    gain("output_speed_wheel_shakes_and_is_counted_twice", "output_speed", 0.06,
         lambda x: 0.6 * shelf(x, 0.18, 0.42, 0.07)),
    # The hub of the shaft creeps round in its cone under load, and springs back at once
    gain("torque_hub_creeps_in_its_cone_and_springs_back", "output_torque", 0.06,
         lambda x: -0.5 * np.sign(x) * teeth(np.abs(x), 0.24, 0.15)),
)
