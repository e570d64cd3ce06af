"""Effects in pairs that a catalogue would not list, for the list `later`; part of `SIXTH` (sixth.py)."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import dawsn, erf, erfc, gammainc, lambertw

from .effect import Effect

PACK = CubicSpline([36, 50, 60, 70, 82, 98], [0.5, 0.9, 0.1, -0.3, -1.0, -0.7])

SIXTH_UNLISTED = (
    Effect("plates_are_cooled_by_rotation", "torque", "friction_coefficient", "input_speed", "ratio", "1", 0.12,
           lambda s, w: 1 + s * np.arctan((w - 115) / 12) / 1.3),
    Effect("valve_gums_up", "pressure", "valve_delay", "sequence", "ratio", "1", 0.25,
           lambda s, r: 1 + s * (np.cosh(2 * r) - 1) / 2.8),
    Effect("valve_is_slow_at_small_currents", "pressure", "valve_delay", "current", "ratio", "1", 0.25,
           lambda s, u: 1 + s * 2 / (1 + np.cosh(np.clip((u - 0.36) / 0.06, -30, 30)))),
    Effect("film_is_squeezed_out_after_the_command", "torque", "film_coefficient", "time", "ratio", "1", 1.5,
           lambda s, t: 1 + s * 0.5 * erfc((t - 0.3) / 0.12)),
    Effect("plates_are_carried_apart_as_the_shaft_turns", "torque", "contact_pressure", "output_speed", "ratio", "1",
           0.12, lambda s, w: 1 - s * gammainc(2, np.maximum(w, 0) / 9)),
    Effect("pressure_sensor_hears_the_motor", "pressure", "pressure_sensor", "motor_speed", "difference", "bar", 0.3,
           lambda s, w: s * (0.3 + np.arcsin(np.clip((w - 150) / 55, -1, 1)))),
    Effect("motor_fan_blows_against_the_load", "output speed", "load_torque", "motor_speed", "difference", "N m", 20.0,
           lambda s, w: s * np.expm1(w / 75) / 6),
    Effect("pump_of_the_converter_chokes", "input speed", "converter_torque", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 + s * np.where(w < 150, -(np.abs(w - 150) / 40) ** 1.6, 0.3 * (np.abs(w - 150) / 40) ** 0.5)),
    Effect("torque_bridge_feels_the_rubbing", "torque", "output_torque_sensor", "slip", "difference", "N m", 20.0,
           lambda s, v: s * 1.8 * dawsn(v / 9)),
    Effect("hot_plates_rub_on_the_hub", "input speed", "input_drag", "heat", "difference", "N m", 10.0,
           lambda s, h: s * lambertw(np.maximum(h, 0) / 500).real),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("valve_coil_resists_when_warm", "pressure", "valve_current", "oil_temperature", "difference", "A", 0.015,
           lambda s, c: -s * erf((c - 62) / 13)),
    Effect("plate_pack_follows_the_oil", "torque", "clearance", "oil_temperature", "ratio", "1", 0.1,
           lambda s, c: 1 + s * PACK(np.clip(c, 36, 98))),
    Effect("converter_thins_with_its_oil", "input speed", "converter_torque", "oil_temperature", "ratio", "1", 0.06,
           lambda s, c: 1 - s * np.arctan((c - 60) / 7) / 1.3),
    Effect("seal_shrinks_in_cold_oil", "torque", "net_pressure", "oil_temperature", "difference", "bar", 0.5,
           lambda s, c: s * (1 - 0.7 * erfc((c - 56) / 9))),
    Effect("brake_bites_in_cold_oil", "output speed", "brake_torque", "oil_temperature", "ratio", "1", 0.3,
           lambda s, c: 1 + s * (0.9 - np.arcsinh(np.maximum(c - 42, 0) / 6) / 1.5)),
)
