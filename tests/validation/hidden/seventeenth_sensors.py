"""Lags, offsets and gain errors of sensors of the list `austral`; part of `SEVENTEENTH` (seventeenth.py)."""

from .seventeenth_shapes import creeps, flutter, foam, grip, isolated, rebound
from .unseen_sensors import gain, lag, offset

SEVENTEENTH_SENSORS = (
    # A screen in front of the port silts up with the oil that passes it to and fro in each run
    lag("pressure_screen_silts_up_in_each_run", "pressure", "silts", 0.01),
    # The receiver of the output speed takes a fast change for an error at first, and repeats its last value
    lag("output_speed_receiver_doubts_fast_changes", "output_speed", "doubts", 0.015),
    # The cap of the sensor comes loose by and by, until it is tightened
    offset("pressure_cap_comes_loose_until_it_is_tightened", "pressure", "sequence", 0.3,
           lambda r: 0.2 + 1.2 * flutter(r, 0.18, 0.7, 0.04)),
    # The controller of the supply overcorrects after the command
    offset("input_speed_supply_overcorrects_after_the_command", "input_speed", "time", 2.5,
           lambda t: 0.3 + 1.1 * rebound(t, 0.16, 0.04, 0.22, 0.7)),
    # The glue of the gauges creeps: at first, hardly in the middle, and before it gives way
    offset("torque_gauge_glue_creeps_in_three_stages", "output_torque", "sequence", 18.0,
           lambda r: 0.1 + 1.2 * creeps(r, 0.08, 0.1)),
    # The filling behind the membrane yields like a foam, and is dense at a high pressure
    gain("pressure_filling_yields_like_a_foam", "pressure", 0.06, lambda x: -0.7 * foam(x, 0.05, 0.65)),
    # The bracket of the pickup is soft, and swings with the wheel
    gain("output_speed_bracket_is_soft", "output_speed", 0.07,
         lambda x: 0.6 * (isolated(x, 0.27, 0.15) - isolated(0.0, 0.27, 0.15))),
    # The gauge sleeve is pressed on the shaft, grips up to a torque, and slips
    gain("torque_sleeve_grips_and_slips", "output_torque", 0.06, lambda x: -0.5 * grip(x, 0.2, 1.85)),
)
