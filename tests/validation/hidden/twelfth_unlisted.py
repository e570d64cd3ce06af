"""Effects in pairs that a catalogue would not list, for the list `remote`; part of `TWELFTH` (twelfth.py)."""

import numpy as np

from .effect import Effect
from .twelfth_shapes import ramp, roof, trough

TWELFTH_UNLISTED = (
    # The field of the coil, which saturates, pulls at the membrane of the sensor beside it
    Effect("pressure_sensor_is_in_the_field_of_the_coil", "pressure", "pressure_sensor", "current", "difference", "bar",
           0.45, lambda s, u: s * (1.5 * u**2 / (u**2 + 0.5**2) - 0.4)),
    # The main line is short of oil while another clutch is filled at the same time
    Effect("another_clutch_is_filled_at_the_same_time", "torque", "oil_temperature_gain", "time", "ratio", "1", 0.1,
           lambda s, t: 1 - s * (1.3 * roof(t, 0.08, 0.2, 0.7) - 0.2)),
    # A seal gives way as the plates bite, and seats anew
    Effect("chamber_seal_seats_anew_in_contact", "torque", "chamber_pressure", "contact_time", "difference", "bar", 0.6,
           lambda s, t: s * (0.4 - 1.4 * np.exp(-((np.maximum(t, 0) / 0.16) ** 1.5)))),
    # The base of the load rocks after the plates bite, and comes to rest
    Effect("load_base_rocks_after_the_bite", "output speed", "load_torque", "contact_time", "difference", "N m", 40.0,
           lambda s, t: s * np.cos(2 * np.pi * t / 0.42) * np.exp(-np.maximum(t, 0) / 0.35)),
    # The heat of a large slip makes bubbles that the pump of the converter takes in, up to what it can swallow
    Effect("bubbles_of_the_slip_reach_the_converter", "input speed", "converter_torque", "slip", "ratio", "1", 0.08,
           lambda s, v: 1 - s * 1.3 * roof(v, 4, 17, 40)),
    # A thread wipes over a flat of the shaft on one half of each turn
    Effect("thread_wipes_over_a_flat_on_half_a_turn", "input speed", "input_drag", "output_position", "difference",
           "N m", 10.0, lambda s, x: s * (1.5 * np.maximum(np.sin(2 * np.pi * x / 3.4), 0) - 0.4)),
    # The rotor of the telemetry stretches above a speed, and rubs on its stator
    Effect("telemetry_rotor_rubs_above_a_speed", "torque", "output_torque_sensor", "motor_speed", "difference", "N m",
           25.0, lambda s, w: s * (1.4 * ramp(w, 145, 172) - 0.4)),
    # The shaft is pressed against the pickup by the plates once they no longer float
    Effect("output_pickup_gap_closes_below_a_slip", "output speed", "output_speed_sensor", "slip", "difference",
           "rad/s", 1.5, lambda s, v: s * (1.3 * np.exp(-((np.maximum(v, 0) / 13) ** 2.5)) - 0.3)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("bearing_grease_gets_soft_between_two_temperatures", "input speed", "input_drag", "oil_temperature",
           "difference", "N m", 10.0, lambda s, c: s * (1.1 - 1.5 * ramp(c, 52, 68))),
    Effect("plate_pack_is_tight_beside_one_temperature", "torque", "clearance", "oil_temperature", "ratio", "1", 0.1,
           lambda s, c: 1 - s * (trough(np.clip(c, 30, 95), 56, 66, 14) - 0.5)),
    Effect("chamber_leaks_through_a_crack_when_warm", "torque", "chamber_pressure", "oil_temperature", "difference",
           "bar", 0.5, lambda s, c: s * (0.3 - (np.clip(c - 54, 0, 40) / 20) ** 1.6)),
)
