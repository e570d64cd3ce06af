"""Effects in pairs that a catalogue would not list, for the list `further`; part of `SEVENTH` (seventh.py)."""

import numpy as np

from .effect import Effect
from .seventh_waves import skewed

SEVENTH_UNLISTED = (
    Effect("plates_wobble_with_the_drum", "torque", "contact_pressure", "output_position", "ratio", "1", 0.15,
           lambda s, x: 1 + s * (0.5 / (1 - 0.8 * np.cos(np.pi * x / 1.9) ** 2) - 1.1)),
    Effect("valve_driver_warms_in_the_shift", "pressure", "valve_delay", "time", "ratio", "1", 0.25,
           lambda s, t: 1 + s * (1 - (1 + np.maximum(t, 0) / 0.3) ** -2)),
    Effect("hot_plates_cone", "torque", "contact_pressure", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 - s * (1 - 1 / np.hypot(1, h / 1500)) / 0.6),
    Effect("film_is_thrown_off_by_the_drum", "torque", "film_coefficient", "output_speed", "ratio", "1", 1.5,
           lambda s, w: 1 + s * (1.2 - 1.5 * np.sqrt(np.clip(w, 0, 9.6) / 15))),
    Effect("plates_float_in_the_flow_of_the_fill", "torque", "clearance", "time", "ratio", "1", 0.1,
           lambda s, t: 1 + s * np.cos(np.pi * np.clip(t / 0.6, 0, 1))),
    Effect("drum_scoop_draws_on_the_chamber", "torque", "chamber_pressure", "output_speed", "difference", "bar", 0.6,
           lambda s, w: -s * (w / 16 - np.sin(2 * np.pi * w / 16) / (2 * np.pi)) / 2),
    Effect("torque_bridge_is_heated_by_the_plates", "torque", "output_torque_sensor", "heat", "difference", "N m", 20.0,
           lambda s, h: s * np.sqrt(np.maximum(h, 0) / 2500)),
    Effect("output_speed_cable_picks_up_the_input", "output speed", "output_speed_sensor", "input_speed", "difference",
           "rad/s", 0.8, lambda s, w: s * np.abs(skewed(w / 150, 0.7))),
    Effect("motor_coupling_binds", "input speed", "input_drag", "motor_speed", "difference", "N m", 10.0,
           lambda s, w: s * (1.2 - np.sqrt(np.abs(w - 150) / 45))),
    Effect("drum_clogs_and_is_cleared", "output speed", "load_torque", "sequence", "difference", "N m", 20.0,
           lambda s, r: s * (1.6 * np.mod(3.3 * r, 1.0) ** 2 - 0.4)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("feed_bore_is_tight_for_cold_oil", "torque", "piston_rate", "oil_temperature", "ratio", "1", 0.2,
           lambda s, c: 1 / (1 + s * (58 / np.maximum(c, 20)) ** 4)),
    Effect("pressure_zero_peaks_at_a_temperature", "pressure", "pressure_sensor", "oil_temperature", "difference",
           "bar", 0.3, lambda s, c: s * (1.2 - np.abs(c - 64) / 14)),
    Effect("torque_zero_follows_the_oil", "torque", "output_torque_sensor", "oil_temperature", "difference", "N m",
           20.0, lambda s, c: s * np.sign(c - 66) * (np.abs(c - 66) / 18) ** 1.5),
    Effect("plates_stick_together_in_cold_oil", "torque", "contact_pressure", "oil_temperature", "ratio", "1", 0.12,
           lambda s, c: 1 - s * (np.maximum(74 - c, 0) / 24) ** 1.5),
    Effect("rotating_oil_drains_when_warm", "torque", "chamber_pressure", "oil_temperature", "difference", "bar", 0.5,
           lambda s, c: -s * np.sqrt(np.maximum(c - 48, 0) / 25)),
)
