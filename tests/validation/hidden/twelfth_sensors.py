"""Lags, offsets and gain errors of sensors of the list `remote`; part of `TWELFTH` (twelfth.py)."""

import numpy as np

from .eleventh_shapes import arch
from .tenth_shapes import shelf
from .twelfth_shapes import ramp, roof, swing
from .unseen_sensors import gain, lag, offset

TWELFTH_SENSORS = (
    # The transmitter was bought to catch peaks: it sends the highest of its last readings
    lag("pressure_transmitter_sends_the_last_peak", "pressure", "peak", 0.008),
    # The counter loses its count whenever it changes the range, and repeats the last reading until it has a new one
    lag("output_speed_counter_is_blind_while_it_changes_range", "output_speed", "blind", 0.015),
    # The vent to the air is blocked, so that the weather counts: a low pressure passes, and then a high one
    offset("pressure_vent_is_blocked_as_the_weather_changes", "pressure", "sequence", 0.3,
           lambda r: 0.35 + 0.8 * swing(r, 0.52, 0.17)),
    # The cable lies beside that of a solenoid, which is on during a part of each engagement
    offset("input_speed_cable_lies_beside_a_solenoid", "input_speed", "time", 2.5,
           lambda t: 0.15 + 1.3 * shelf(t, 0.22, 0.75, 0.12)),
    # The old amplifier drifts ever faster until it is exchanged; the new one is cold at first
    offset("torque_amplifier_is_exchanged", "output_torque", "sequence", 20.0,
           lambda r: np.where(r < 0.56, 0.1 + 1.3 * (np.maximum(r, 0) / 0.56) ** 2,
                              0.2 - 0.8 * np.exp(-(np.maximum(r, 0.56) - 0.56) / 0.14))),
    # The most significant bit of the converter counts for too much
    gain("pressure_converter_has_a_bit_too_large", "pressure", 0.07, lambda x: 0.6 * ramp(x, 0.44, 0.46)),
    # The brushes of the tachometer lift off in a band of speeds
    gain("tachometer_brushes_lift_in_a_band", "output_speed", 0.06, lambda x: -0.6 * arch(x, 0.07, 0.44)),
    # A bush takes its part of the torque between two torques; from a third one on the shaft is wrung clear of it
    gain("torque_shaft_touches_a_bush_and_leaves_it", "output_torque", 0.06,
         lambda x: -0.5 * np.sign(x) * roof(np.abs(x), 0.08, 0.26, 0.6)),
)
