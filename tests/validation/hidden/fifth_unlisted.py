"""Effects in pairs that a catalogue would not list, for the list `fresh`; part of `FIFTH` (fifth.py)."""

import numpy as np

from .effect import Effect

FIFTH_UNLISTED = (
    Effect("plates_are_flooded_at_the_command", "torque", "friction_coefficient", "time", "ratio", "1", 0.15,
           lambda s, t: 1 - s / (1 + (np.maximum(t, 0) / 0.6) ** 5)),
    Effect("valve_is_slow_against_pressure", "pressure", "valve_delay", "pressure", "ratio", "1", 0.25,
           lambda s, p: 1 + s * (np.maximum(p, 0) / 6) ** 2 / (1 + np.maximum(p, 0) / 6)),
    Effect("film_is_flung_out", "torque", "film_coefficient", "input_speed", "ratio", "1", 1.5,
           lambda s, w: 1 / (1 + s * (w / 110) ** 3)),
    Effect("lining_soaks_up_oil", "torque", "contact_pressure", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 - s * r * np.maximum(2 - r, 0)),
    Effect("pressure_sensor_is_heated_by_the_shift", "pressure", "pressure_sensor", "time", "difference", "bar", 0.3,
           lambda s, t: s * (t / 0.7) * np.exp(1 - t / 0.7)),
    Effect("load_is_dragged_by_the_open_plates", "output speed", "load_torque", "slip", "difference", "N m", 25.0,
           lambda s, v: -s * np.sqrt(np.maximum(v, 0) / 25)),
    Effect("converter_is_robbed_of_its_charge", "input speed", "converter_torque", "pressure", "ratio", "1", 0.1,
           lambda s, p: 1 - s * np.maximum(1 - np.abs(p - 5.5) / 4.5, 0)),
    Effect("feed_screen_clogs", "torque", "piston_rate", "sequence", "ratio", "1", 0.15,
           lambda s, r: 1 - s * np.clip(r, 0, 1) ** 2 * (3 - 2 * np.clip(r, 0, 1))),
    Effect("input_bearing_runs_in", "input speed", "input_drag", "sequence", "difference", "N m", 10.0,
           lambda s, r: s * np.maximum(1 - r, 0) ** 3),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("film_follows_the_viscosity", "torque", "film_coefficient", "oil_temperature", "ratio", "1", 1.0,
           lambda s, c: np.exp(s * (900 / (np.maximum(c, 0) + 95) - 5.8))),
    Effect("valve_is_slow_in_cold_oil", "pressure", "valve_delay", "oil_temperature", "ratio", "1", 0.25,
           lambda s, c: 1 + s * (55 / np.maximum(c, 20)) ** 3),
    Effect("load_gears_churn_cold_oil", "output speed", "load_torque", "oil_temperature", "difference", "N m", 20.0,
           lambda s, c: s * (1.4 - 0.9 * np.tanh((c - 52) / 9))),
)
