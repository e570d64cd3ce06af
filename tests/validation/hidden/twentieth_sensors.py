"""Lags, offsets and gain errors of sensors of the list `glacial`; part of `TWENTIETH` (twentieth.py)."""

import numpy as np

from .twentieth_shapes import doubling, jam, locking, revived, slam, twisted
from .unseen_sensors import gain, lag, offset

TWENTIETH_SENSORS = (
    # The amplifier is shared: it follows the pressure by turns with another sensor, and holds it meanwhile
    lag("pressure_amplifier_follows_by_turns", "pressure", "tracks", 0.012),
    # The wheel of the output has a wide gap, while which passes there is no pulse, and the reading is held
    lag("output_speed_wheel_has_a_wide_gap", "output_speed", "gaps", 0.03),
    # A tank beside the sensor is filled, runs over, and is emptied evenly
    offset("pressure_sensor_is_pushed_by_a_tank_that_runs_over", "pressure", "sequence", 0.3,
           lambda r: 0.15 + 1.2 * jam(r, 0.4, 0.5, 0.96)),
    # Two converters on the supply hum nearly alike: the hum dies out and is revived
    offset("input_speed_supply_hum_is_revived", "input_speed", "time", 2.5,
           lambda t: 0.3 + 1.0 * revived(t - 0.12, 0.17, 0.52)),
    # A door of the hall slams in a storm, which lifts the floor before and after it
    offset("torque_floor_is_lifted_before_and_after_a_storm", "output_torque", "sequence", 18.0,
           lambda r: 0.25 + 1.0 * slam(r, 0.42, 0.16)),
    # The membrane is read by the light through a crystal, which it untwists from a pressure on
    gain("pressure_membrane_untwists_a_crystal", "pressure", 0.06, lambda x: 0.6 * twisted(x, 0.16, 0.9, 2)),
    # Every other pole of the wheel is weak, which counts once the speed is high
    gain("output_speed_wheel_has_weak_poles", "output_speed", 0.07,
         lambda x: 0.5 * (doubling(x, 0.2, 0.15, 0.6) - 1)),
    # The gauge sleeve follows the shaft in steps of three sizes
    gain("torque_sleeve_follows_in_steps_of_three_sizes", "output_torque", 0.06,
         lambda x: -0.5 * np.sign(x) * locking(np.abs(x), 0.02, 0.8)),
)
