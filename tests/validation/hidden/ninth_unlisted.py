"""Effects in pairs that a catalogue would not list, for the list `abroad`; part of `NINTH` (ninth.py)."""

import numpy as np

from .effect import Effect
from .ninth_shapes import burr, edge, hinge, hump

NINTH_UNLISTED = (
    Effect("gear_oil_pump_shares_the_line", "pressure", "pressure_gain", "output_speed", "ratio", "1", 0.08,
           lambda s, w: 1 - s * edge(w, 9, 1.5) * (1 + 0.01 * np.clip(w, 0, 60))),
    Effect("alternator_voltage_reaches_the_valve", "pressure", "valve_current", "motor_speed", "difference", "A", 0.015,
           lambda s, w: s * (0.8 - 2 * hinge(w, 152, 8) / 48)),
    Effect("hot_plates_grow_thick", "torque", "clearance", "heat", "ratio", "1", 0.25,
           lambda s, h: 1 - s * (1 - np.exp(-np.maximum(h, 0) / 1200)) ** 1.6),
    Effect("brake_lets_go_while_the_plates_bite", "output speed", "brake_torque", "contact_time", "ratio", "1", 0.3,
           lambda s, t: 1 - s * (1 - np.exp(-((np.maximum(t, 0) / 0.22) ** 2.3)))),
    Effect("converter_takes_in_oil_from_the_hot_plates", "input speed", "converter_torque", "heat", "ratio", "1", 0.08,
           lambda s, h: 1 - s * np.minimum(np.maximum(h, 0) / 2400, 2.2) ** 0.65),
    Effect("input_pickup_hears_the_output_gear", "input speed", "input_speed_sensor", "output_speed", "difference",
           "rad/s", 4.0, lambda s, w: s * (1.2 * burr(w, 5, 0.8, 14) - 0.2)),
    Effect("torque_bridge_is_warmed_in_contact", "torque", "output_torque_sensor", "contact_time", "difference", "N m",
           20.0, lambda s, t: s * np.maximum(t, 0) ** 1.7 / (np.maximum(t, 0) ** 1.7 + 0.3**1.7)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("relief_valve_is_lazy_in_cold_oil", "pressure", "pressure_gain", "oil_temperature", "ratio", "1", 0.06,
           lambda s, c: 1 + s * (1.1 * edge(-c, -61, 2) - 0.3)),
    Effect("output_speed_pickup_moves_with_the_housing", "output speed", "output_speed_sensor", "oil_temperature",
           "difference", "rad/s", 0.8, lambda s, c: s * (hinge(c, 58, 2) / 18 - 0.4)),
    Effect("film_is_thickest_at_a_temperature", "torque", "film_coefficient", "oil_temperature", "ratio", "1", 1.2,
           lambda s, c: 1 + s * hump(c - 38, 20, 2.6)),
)
