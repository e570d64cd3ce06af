"""Effects in pairs that a catalogue would not list, for the list `elsewhere`; part of `FOURTH` (fourth.py)."""

import numpy as np

from .effect import Effect

FOURTH_UNLISTED = (
    Effect("plates_are_spread_by_rotation", "torque", "contact_pressure", "input_speed", "ratio", "1", 0.15,
           lambda s, w: 1 - s * np.clip((w - 80) / 70, 0, 1)),
    Effect("film_is_thick_under_pressure", "torque", "film_coefficient", "pressure", "ratio", "1", 1.5,
           lambda s, p: 1 + s * np.maximum(p, 0) ** 1.5 / (np.maximum(p, 0) ** 1.5 + 4)),
    Effect("plates_creep", "torque", "clearance", "contact_time", "ratio", "1", 0.1,
           lambda s, t: 1 + s * np.log1p(np.maximum(t, 0) / 0.05) / 3),
    Effect("friction_fails_as_the_shaft_starts", "torque", "friction_coefficient", "output_position", "ratio", "1",
           0.15, lambda s, x: 1 - s / (1 + (np.maximum(x, 0) / 2.5) ** 2)),
    Effect("torque_bridge_feels_the_motor", "torque", "output_torque_sensor", "input_speed", "difference", "N m",
           20.0, lambda s, w: s * np.interp(w, [70, 110, 150, 190], [1.0, -0.6, -0.6, 0.7])),
    Effect("converter_is_full_of_air_at_first", "input speed", "converter_torque", "time", "ratio", "1", 0.12,
           lambda s, t: 1 - s * np.exp(-((np.maximum(t, 0) / 0.3) ** 2.2))),
    Effect("pilot_bearing_drags", "input speed", "input_drag", "slip", "difference", "N m", 10.0,
           lambda s, v: s * np.log1p(np.maximum(v, 0) / 4) / 2),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("pump_leaks_when_warm", "pressure", "pressure_gain", "oil_temperature", "ratio", "1", 0.06,
           lambda s, c: 1 - s * np.interp(c, [45, 58, 75, 90], [0, 0.15, 1.0, 1.1])),
    Effect("grease_is_stiff_when_cold", "input speed", "input_drag", "oil_temperature", "difference", "N m", 10.0,
           lambda s, c: s * np.exp(-(np.maximum(c, 0) - 40) / 16)),
)
