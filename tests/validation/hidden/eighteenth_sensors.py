"""Lags, offsets and gain errors of sensors of the list `boreal`; part of `EIGHTEENTH` (eighteenth.py)."""

import numpy as np

from .eighteenth_shapes import captured, chopped, code, passband, puddles, yields
from .unseen_sensors import gain, lag, offset

EIGHTEENTH_SENSORS = (
    # A bubble in the port gives way at low pressures, and dissolves at higher ones
    lag("pressure_port_holds_a_bubble_that_dissolves", "pressure", "bubbles", 0.012),
    # The recorder of the output speed shares its computer, and starts far too late in some runs
    lag("output_speed_recorder_starts_late_in_some_runs", "output_speed", "waits", 0.015),
    # Rain drips on the sensor in some runs, and dries up
    offset("pressure_sensor_is_rained_on_and_dries", "pressure", "sequence", 0.3,
           lambda r: 0.15 + 1.2 * puddles(r, 3.6, (0.21, 0.6), (0.3, 0.7), (0.72, 0.9))),
    # The thyristor of a heater cuts the supply
    offset("input_speed_supply_is_chopped_by_a_heater", "input_speed", "time", 2.5,
           lambda t: 0.4 + 0.9 * chopped(t - 0.05, 0.52, 0.45)),
    # The neighbouring rig pulls at the floor in its shifts
    offset("torque_floor_is_pulled_in_shifts_of_a_rig", "output_torque", "sequence", 18.0,
           lambda r: 0.2 + 1.1 * code(r, 0.142, "1110010")),
    # The string of the sensor is captured by a hum between two pressures
    gain("pressure_string_is_captured_by_a_hum", "pressure", 0.06, lambda x: 0.55 * captured(x, 0.25, 0.68, 0.02)),
    # The pickup is read through a ladder filter, whose ripples count as speed
    gain("output_speed_is_read_through_a_ladder", "output_speed", 0.07,
         lambda x: 0.7 * (passband(x, 0.5, 4) - passband(np.zeros_like(x), 0.5, 4))),
    # The pin of the gauge sleeve yields at a torque, and hardens at a larger one
    gain("torque_sleeve_pin_yields_and_hardens", "output_torque", 0.06,
         lambda x: -0.5 * np.sign(x) * yields(np.abs(x), 0.18, 0.42, 0.2)),
)
