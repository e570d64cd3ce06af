"""Effects in pairs that a catalogue would not list, for the list `unseen`; part of `THIRD` (third.py)."""

import numpy as np

from .effect import Effect

THIRD_UNLISTED = (
    Effect("spool_moves_in_jumps", "pressure", "pressure_demand", "pressure", "difference", "bar", 0.5,
           lambda s, p: s * (np.sin(2 * np.pi * p / 2.6) + 0.4 * np.sin(4 * np.pi * p / 2.6))),
    Effect("piston_passes_a_port", "torque", "chamber_pressure", "piston", "difference", "bar", 1.2,
           lambda s, x: -s * np.exp(-(((x - 0.0013) / 0.0003) ** 2))),
    Effect("plates_judder", "torque", "friction_coefficient", "output_position", "ratio", "1", 0.15,
           lambda s, x: 1 + s * np.sin(2 * np.pi * x / 1.7) / (1 + np.maximum(x, 0) / 6)),
    Effect("shaft_twists_to_and_fro", "torque", "output_torque_sensor", "time", "difference", "N m", 40.0,
           lambda s, t: s * np.exp(-t / 0.5) * np.sin(2 * np.pi * t / 0.085), ("output torque sensor", "time")),
    Effect("load_winds_up", "output speed", "brake_torque", "output_position", "ratio", "1", 0.5,
           lambda s, x: 1 - s * np.exp(-np.maximum(x, 0) / 1.2)),
    Effect("load_rope_slackens", "output speed", "load_torque", "output_position", "difference", "N m", 25.0,
           lambda s, x: -s * np.exp(-(((x - 4) / 2) ** 2))),
    Effect("motor_torque_ripples", "input speed", "converter_torque", "pump_angle", "ratio", "1", 0.08,
           lambda s, x: 1 + s * np.sin(x) * (1 + 0.5 * np.cos(x))),
    Effect("converter_blades_stall", "input speed", "converter_torque", "input_speed", "ratio", "1", 0.12,
           lambda s, w: 1 - s * np.exp(-(((w - 118) / 16) ** 2))),
    Effect("bearing_drag_has_a_peak", "input speed", "input_drag", "input_speed", "difference", "N m", 12.0,
           lambda s, w: s * np.exp(-(((w - 110) / 25) ** 2))),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("piston_gain_follows_the_oil", "torque", "oil_temperature_gain", "oil_temperature", "ratio", "1", 0.1,
           lambda s, c: 1 + s * np.tanh((c - 68) / 10)),
    Effect("friction_fades_in_warm_oil", "torque", "friction_coefficient", "oil_temperature", "ratio", "1", 0.12,
           lambda s, c: 1 - s * np.maximum(c - 60, 0) ** 1.5 / 150),
)
