"""The effects of the bench: `PHYSICAL` ones, which a catalogue would list, and `UNLISTED` ones, which it would not.

Exponents, saturations and small second terms differ on purpose from the textbook forms, as real effects do.
Units: bar, A, m, s, rad/s, N m, J; `sequence` increases from 0 for the first run to 1 for the last.
"""

import numpy as np

from .effect import Effect

PHYSICAL = (
    Effect("friction_falls_with_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.2,
           lambda s, v: 1 + s * np.exp(-((v / 14) ** 1.3))),
    Effect("friction_rises_with_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.2,
           lambda s, v: 1 - s / (1 + (v / 10) ** 2)),
    Effect("friction_falls_with_pressure", "torque", "friction_coefficient", "contact_pressure", "ratio", "1", 0.15,
           lambda s, p: ((3 + p) / 7) ** -s),
    Effect("thermal_fade", "torque", "friction_coefficient", "energy", "ratio", "1", 0.2,
           lambda s, e: 1 - s * (1 - np.exp(-((np.maximum(e, 0) / 9e3) ** 1.1)))),
    Effect("friction_build_up", "torque", "friction_lag", "contact_pressure", "difference", "s", 0.02,
           lambda s, p: s * (0.6 + 0.8 / (1 + p / 3))),
    Effect("oil_temperature_piston", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * (1.25 * r - 0.25 * r**2)),
    Effect("oil_temperature_film", "torque", "film_coefficient", "sequence", "ratio", "1", 1.5,
           lambda s, r: np.exp(-s * (0.9 * r + 0.1 * r**2))),
    Effect("centrifugal_head", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.6,
           lambda s, w: s * (0.9 * (w / 150) ** 2.1 + 0.1 * w / 150)),
    Effect("supply_droop", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.08,
           lambda s, w: 1 - s * np.exp(-(((w - 100) / 50) ** 2))),
    Effect("flow_limited_fill", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.7,
           lambda s, v: (1 + (s * np.abs(v) / 0.015) ** 2.5) ** (-1 / 2.5)),
    Effect("entrained_air", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s / (1 + np.maximum(p, 0) / 1.5) ** 1.4),
    Effect("valve_hysteresis", "pressure", "valve_play", "direction", "difference", "A", 0.012,
           lambda s, d: s * (1.0 + 0.2 * d)),
    Effect("valve_deadband", "pressure", "valve_current", "current", "difference", "A", 0.03,
           lambda s, u: -s * np.tanh((np.maximum(u - 0.1, 0) / 0.2) ** 1.2)),
    Effect("seal_friction", "torque", "net_pressure", "driving_pressure", "difference", "bar", 0.8,
           lambda s, p: -s * np.tanh(p / max(s, 1e-9)) * (0.85 + 0.15 * np.exp(-np.abs(p) / 1.5))),
    Effect("spring_stiffening", "torque", "spring_rate", "piston", "ratio", "1", 0.8,
           lambda s, x: 1 + s * np.maximum(x / 0.002, 0) ** 2.4),
    Effect("quadratic_load_drag", "output speed", "load_torque", "output_speed", "difference", "N m s^2", 0.01,
           lambda s, w: s * (w**2 + 2 * w)),
    Effect("load_friction_falls", "output speed", "brake_torque", "output_speed", "ratio", "1", 0.35,
           lambda s, w: 1 - s * (1 - 1 / (1 + (np.maximum(w, 0) / 12) ** 1.6))),
    Effect("shaft_compliance", "torque", "shaft_compliance", "sequence", "difference", "rad/(N m)", 2e-4,
           lambda s, r: s + 0 * r),
    Effect("converter_lag", "input speed", "converter_lag", "motor_speed", "difference", "s", 0.05,
           lambda s, w: s * (150 / w) ** 0.5),
    Effect("wear", "torque", "clearance", "sequence", "ratio", "1", 0.08,
           lambda s, r: 1 + s * (1 - np.exp(-1.5 * r)) / (1 - np.exp(-1.5))),
)

UNLISTED = (
    Effect("friction_waves_with_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.12,
           lambda s, v: 1 + s * np.sin(2 * np.pi * v / 16)),
    Effect("friction_with_motor_speed_and_pressure", "torque", "friction_coefficient", "load_point", "ratio", "1", 0.2,
           lambda s, x: 1 + s * (x / (0.5 + x) - 0.4)),
    Effect("friction_grows_in_contact", "torque", "friction_coefficient", "contact_time", "ratio", "1", 0.2,
           lambda s, t: 1 + s * (t / 0.3) ** 2 / (1 + (t / 0.3) ** 2)),
    Effect("torque_sensor_feels_pressure", "torque", "output_torque_sensor", "pressure", "difference", "N m/bar", 2.0,
           lambda s, p: s * p),
    Effect("valve_ripples_with_current", "pressure", "valve_current", "current", "difference", "A", 0.01,
           lambda s, u: s * np.sin(2 * np.pi * (u - 0.1) / 0.17)),
    Effect("pump_pulsation", "pressure", "pressure_demand", "pump_angle", "difference", "bar", 0.6,
           lambda s, x: s * np.sin(x)),
    Effect("load_waves_in_time", "output speed", "load_torque", "time", "difference", "N m", 30.0,
           lambda s, t: s * np.sin(2 * np.pi * t / 0.7)),
    Effect("load_dragged_by_input", "output speed", "load_torque", "input_speed", "difference", "N m", 25.0,
           lambda s, w: -s * (w / 150) ** 1.5),
    Effect("root_of_speed_input_drag", "input speed", "input_drag", "input_speed", "difference", "N m s^0.5", 1.0,
           lambda s, w: s * np.sqrt(np.maximum(w, 0))),
    Effect("pump_loads_input", "input speed", "input_drag", "pressure", "difference", "N m/bar", 1.5,
           lambda s, p: s * np.maximum(p, 0)),
)
