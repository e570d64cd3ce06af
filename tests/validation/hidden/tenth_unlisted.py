"""Effects in pairs that a catalogue would not list, for the list `afield`; part of `TENTH` (tenth.py)."""

import numpy as np

from .effect import Effect
from .fifth import passage
from .ninth_shapes import burr, edge, hinge, hump
from .tenth_shapes import crest, warmed

TENTH_UNLISTED = (
    # A lubrication valve opens as the plates bite, until its own line is full
    Effect("lubrication_valve_opens_as_the_plates_bite", "pressure", "pressure_gain", "contact_time", "ratio", "1",
           0.06, lambda s, t: 1 - s * 1.3 * warmed(t, 0.04, 0.3, 0.07, 0.3)),
    Effect("film_tears_as_the_gap_closes", "torque", "film_coefficient", "piston_position", "ratio", "1", 1.5,
           lambda s, x: 1 + s * (1.2 * edge(-x, -0.0013, 0.0002) - 0.2)),
    Effect("piston_is_tilted_by_rotation", "torque", "oil_temperature_gain", "input_speed", "ratio", "1", 0.1,
           lambda s, w: 1 - s * 1.2 * crest(w, 118, 25, 40)),
    Effect("converter_takes_in_air_as_the_plates_bite", "input speed", "converter_torque", "contact_time", "ratio", "1",
           0.08, lambda s, t: 1 - s * 1.2 * hump(t, 0.15, 1.4)),
    Effect("lubrication_pump_labours_once_the_plates_grip", "input speed", "input_drag", "contact_time", "difference",
           "N m", 10.0, lambda s, t: s * (0.2 + 1.1 * edge(t, 0.2, 0.03))),
    Effect("pressure_sensor_is_shaken_by_the_load", "pressure", "pressure_sensor", "output_speed", "difference", "bar",
           0.3, lambda s, w: s * (0.9 * passage(w, 12, 4) - 0.2)),
    Effect("input_pickup_moves_with_the_piston_plate", "input speed", "input_speed_sensor", "pressure", "difference",
           "rad/s", 2.0, lambda s, p: s * (hinge(p, 4.5, 0.5) / 4 - 0.2)),
    Effect("output_pickup_is_heated_by_the_plates", "output speed", "output_speed_sensor", "heat", "difference",
           "rad/s", 2.0, lambda s, h: s * (1.2 * burr(h, 800, 120, 2500) - 0.2)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("spool_sticks_at_a_temperature", "pressure", "valve_delay", "oil_temperature", "ratio", "1", 0.25,
           lambda s, c: 1 + s * (1.6 * crest(c, 62, 5, 9) - 0.4)),
    Effect("plates_are_wetted_at_a_temperature", "torque", "contact_pressure", "oil_temperature", "ratio", "1", 0.12,
           lambda s, c: 1 + s * passage(c, 60, 7)),
    Effect("load_gear_oil_thickens_at_both_ends", "output speed", "load_torque", "oil_temperature", "difference", "N m",
           20.0, lambda s, c: s * ((np.abs(c - 63) / 18) ** 1.6 - 0.4)),
)
