"""Effects in pairs that a catalogue would not list, for the list `beyond`; part of `EIGHTH` (eighth.py)."""

import numpy as np

from .effect import Effect
from .eighth_waves import flat, modulated

EIGHTH_UNLISTED = (
    Effect("plates_tilt_and_settle", "torque", "contact_pressure", "contact_time", "ratio", "1", 0.12,
           lambda s, t: 1 - s * np.cos(9 * np.maximum(t, 0)) / (1 + np.maximum(t, 0) / 0.25)),
    Effect("converter_shares_the_oil_of_the_output_pump", "input speed", "converter_torque", "output_speed", "ratio",
           "1", 0.08, lambda s, w: 1 - s * np.minimum(np.maximum(w, 0) / 14, 1) ** 3),
    Effect("valve_is_shaken_by_the_shaft", "pressure", "valve_delay", "input_speed", "ratio", "1", 0.25,
           lambda s, w: 1 + s * modulated(w / 110, 0.2)),
    Effect("pressure_sensor_hears_the_judder", "pressure", "pressure_sensor", "slip", "difference", "bar", 0.3,
           lambda s, v: s * flat(np.sqrt(np.maximum(v, 0) / 18))),
    Effect("brake_shares_the_cooling_oil", "output speed", "brake_torque", "heat", "ratio", "1", 0.3,
           lambda s, h: 1 - s * np.sqrt(np.minimum(np.maximum(h, 0) / 3500, 1.2))),
    Effect("film_oil_is_heated_thin", "torque", "film_coefficient", "heat", "ratio", "1", 1.5,
           lambda s, h: 1 + s * (0.8 - np.arctan(np.maximum(h, 0) / 900) / 1.2)),
    Effect("pickup_bracket_is_bent_by_the_feed", "output speed", "output_speed_sensor", "pressure", "difference",
           "rad/s", 0.8, lambda s, p: s * (0.3 - np.log1p((np.maximum(p, 0) / 4) ** 3) / 3)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("input_speed_gap_follows_the_oil", "input speed", "input_speed_sensor", "oil_temperature", "difference",
           "rad/s", 1.5, lambda s, c: s * np.cos((c - 45) / 11)),
    Effect("lining_is_tacky_at_a_temperature", "torque", "friction_coefficient", "oil_temperature", "ratio", "1", 0.12,
           lambda s, c: 1 + s * (1.2 - np.abs(np.abs(c - 66) - 9) / 9)),
    Effect("feed_air_leaves_warm_oil", "torque", "piston_feed", "oil_temperature", "difference", "m/bar", 8e-5,
           lambda s, c: -s / (1 + (np.maximum(c, 0) / 62) ** 8)),
)
