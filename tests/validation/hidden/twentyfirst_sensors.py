"""Lags, offsets and gain errors of sensors of the list `lunar`; part of `TWENTYFIRST` (twentyfirst.py)."""

import numpy as np

from .twentyfirst_shapes import activity, branches, doses, regimes, relaxing, stopping
from .unseen_sensors import gain, lag, offset

TWENTYFIRST_SENSORS = (
    # The oil in the sensor's line sets while it rests, and is stirred thin again as the pressure moves it
    lag("pressure_line_sets_while_it_rests", "pressure", "sets", 0.012),
    # The telemetry of the output sends now and then, and its receiver goes on as it was told last
    lag("output_speed_receiver_goes_on_as_told", "output_speed", "predicts", 0.03),
    # Water creeps into the cap of the sensor, ever faster until it is poured out, and comes back
    offset("pressure_cap_takes_in_water_and_is_emptied", "pressure", "sequence", 0.3,
           lambda r: 0.15 + 1.2 * activity(r, 0.11, 0.58, 0.012, 0.75)),
    # Three loads are switched on and off on the supply, whose regulator makes up for most of each
    offset("input_speed_supply_makes_up_for_three_loads", "input_speed", "time", 2.5,
           lambda t: 0.4 + 1.0 * relaxing(t, 0.008, 0.16, 0.4, (0.11, 1.0), (0.36, -1.4), (0.68, 1.3))),
    # The rig beside is filled with hot oil and with cold oil, which the floor feels late
    offset("torque_floor_feels_oil_of_the_rig_beside", "output_torque", "sequence", 18.0,
           lambda r: 0.3 + 1.0 * doses(r, 0.03, 0.12, (0.09, 0.8), (0.34, -0.9), (0.66, 1.0))),
    # The membrane comes to lie on one ring after another, between which it bulges
    gain("pressure_membrane_lies_down_on_rings", "pressure", 0.06,
         lambda x: 0.45 * regimes(x, 0.012, (0.1, 6), (0.24, -6.5), (0.4, 8), (0.52, -7), (0.66, 3), (0.85, 0))),
    # The pickup's signal grows ever faster as the wheel comes near a speed, above which its trigger skips the surplus
    gain("output_speed_trigger_skips_the_surplus", "output_speed", 0.07,
         lambda x: 0.8 * (stopping(x, 0.4, 0.015) - 0.29)),
    # The sleeve of the gauges slips on its glue, which holds it in three ways
    gain("torque_sleeve_slips_in_three_ways", "output_torque", 0.06,
         lambda x: -0.5 * np.sign(x) * branches(np.abs(x), 0.04, 0.7)),
)
