"""Lags, offsets and gain errors of sensors of the list `polar`; part of `SIXTEENTH` (sixteenth.py)."""

from .sixteenth_shapes import crowded, overtones, recoil, slits, winds
from .unseen_sensors import gain, lag, offset

SIXTEENTH_SENSORS = (
    # The membrane rests on an oily plate: it is pressed off at once, and clings to it as the pressure falls
    lag("pressure_membrane_clings_as_the_pressure_falls", "pressure", "clings", 0.015),
    # The pulses of the output are followed by a loop that locks on their phase, and is hardly damped
    lag("output_speed_loop_locks_on_the_phase", "output_speed", "locks", 0.03),
    # The sun passes behind the slats of a louvre around noon
    offset("pressure_sensor_lies_behind_a_louvre", "pressure", "sequence", 0.3,
           lambda r: 0.35 + 0.8 * winds(r, 0.53, 0.22, 3)),
    # A relay of the same supply switches to and fro, and its coil rings
    offset("input_speed_supply_rings_as_a_relay_switches", "input_speed", "time", 2.5,
           lambda t: 0.3 + 0.8 * overtones(t - 0.08, 0.56)),
    # The cement of a new gauge gives way at first, and shrinks as it sets
    offset("torque_gauge_cement_gives_way_and_shrinks", "output_torque", "sequence", 18.0,
           lambda r: 0.2 + 1.1 * recoil(r, 0.3, 0.13)),
    # The membrane has corrugations, ever closer to each other towards its rim
    gain("pressure_membrane_corrugations_crowd_at_its_rim", "pressure", 0.06,
         lambda x: -0.5 * crowded(x, -0.95, 0.95, 7)),
    # Three pole pieces of the pickup add up at some speeds, and hardly in between
    gain("output_speed_pickup_has_three_poles", "output_speed", 0.07, lambda x: 0.6 * slits(x - 0.24, 0.29, 3)),
    # A comparator switches the bridge over at torques that are evenly spaced, and rings
    gain("torque_bridge_is_switched_over_and_rings", "output_torque", 0.06, lambda x: -0.45 * overtones(x, 0.46)),
)
