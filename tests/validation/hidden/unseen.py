"""Effects that no case of the development list has: `UNSEEN`, the unseen forms of listed and of unlisted pairs.

Units and scales are those of catalogue.py. The forms saturate, have thresholds and broken exponents, differ between
directions or mix two mechanisms, as measured characteristics do.
"""

import numpy as np

from .effect import Effect
from .unseen_sensors import UNSEEN_SENSORS
from .unseen_unlisted import UNSEEN_UNLISTED

UNSEEN_PHYSICAL = (
    # Line pressure and valve
    Effect("starved_pump", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.1,
           lambda s, w: 1 - s * np.log1p(np.exp((150 - w) / 12)) * 12 / 45, ("line pressure", "motor speed")),
    Effect("pump_between_two_stages", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.05,
           lambda s, w: 1 + s * np.tanh((w - 150) / 25) * (1 - 0.3 * (w - 150) / 50), ("line pressure", "motor speed")),
    Effect("valve_with_many_plays", "pressure", "valve_plays", "fraction", "difference", "A", 0.04,
           lambda s, x: s * x**1.7, ("valve current", "past current")),
    Effect("remanent_magnet", "pressure", "valve_current", "current_excess", "difference", "A", 0.012,
           lambda s, i: -s * np.where(i > 0, 1.0, 0.6) * np.tanh(i / 0.05), ("valve current", "past current")),
    Effect("magnet_saturates", "pressure", "valve_current", "current", "difference", "A", 0.05,
           lambda s, u: -s * (np.maximum(u - 0.35, 0) / 0.4) ** 1.6, ("valve current", "current")),
    Effect("valve_land_overlaps", "pressure", "valve_current", "current", "difference", "A", 0.025,
           lambda s, u: -s * np.exp(-np.abs((u - 0.36) / 0.09) ** 2.5), ("valve current", "current")),
    # Piston
    Effect("centrifugal_oil_above_a_speed", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.6,
           lambda s, w: s * np.maximum(w / 150 - 0.45, 0) ** 1.5 / 0.41, ("chamber pressure", "input speed")),
    Effect("balanced_centrifugal_oil", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.6,
           lambda s, w: s * 1.6 * w**2 / (w**2 + 120.0**2), ("chamber pressure", "input speed")),
    Effect("oil_warms_late", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s / (1 + np.exp(-(r - 0.45) / 0.09)), ("piston gain", "run order")),
    Effect("oil_warms_at_once", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.08,
           lambda s, r: 1 - s * (1 - np.exp(-(r / 0.12) ** 0.8)), ("piston gain", "run order")),
    Effect("plates_run_in", "torque", "clearance", "sequence", "ratio", "1", 0.08,
           lambda s, r: 1 + s * (0.7 * np.minimum(r / 0.2, 1) + 0.3 * r), ("clearance", "run order")),
    Effect("plates_wear_ever_faster", "torque", "clearance", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * r**2.8, ("clearance", "run order")),
    Effect("air_in_the_chamber", "torque", "oil_temperature_gain", "pressure", "ratio", "1", 0.15,
           lambda s, p: 1 - s / (1 + (np.maximum(p, 0) / 2.5) ** 1.3), ("piston gain", "pressure")),
    Effect("plates_yield", "torque", "clearance", "pressure", "ratio", "1", 0.08,
           lambda s, p: 1 + s * (np.maximum(p, 0) / 5) ** 0.7 / (1 + np.maximum(p, 0) / 12), ("clearance", "pressure")),
    Effect("orifice_in_the_feed", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.25,
           lambda s, v: 2 / (1 + np.sqrt(1 + 4 * s * np.maximum(v, 0) / 0.008)), ("piston rate", "piston rate")),
    Effect("pump_flow_is_used_up", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.35,
           lambda s, v: 1 - s * np.where(v > 0.004, 1 - (0.004 / np.maximum(np.abs(v), 0.004)) ** 0.8, 0),
           ("piston rate", "piston rate")),
    Effect("wave_spring_engages", "torque", "net_pressure", "piston", "difference", "bar", 0.8,
           lambda s, x: -s * np.clip((x - 0.0009) / 0.0007, 0, 1) ** 1.4, ("piston rate", "piston position")),
    Effect("spring_softens_then_stiffens", "torque", "spring_rate", "piston", "ratio", "1", 0.4,
           lambda s, x: 1 + s * (np.minimum(np.maximum(x, 0) / 0.0012, 4) ** 3 - 1) * 0.7,
           ("piston rate", "piston position")),
    Effect("lip_seal_rubs", "torque", "net_pressure", "driving_pressure", "difference", "bar", 0.7,
           lambda s, p: -s * np.tanh(p / 0.8) * np.where(p > 0, 1.0, 0.45), ("piston rate", "direction")),
    Effect("seal_rubs_under_pressure", "torque", "net_pressure", "driving_pressure", "difference", "bar", 0.7,
           lambda s, p: -s * np.sign(p) * np.minimum(np.abs(p), 3) ** 0.7 / 1.5, ("piston rate", "direction")),
    # Plates
    Effect("stribeck_hump", "torque", "friction_coefficient", "slip", "ratio", "1", 0.2,
           lambda s, v: 1 + s / (1 + (v / 5) ** 1.5), ("friction coefficient", "slip")),
    Effect("friction_falls_above_a_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.25,
           lambda s, v: 1 - s * np.maximum(v - 12, 0) / (np.maximum(v - 12, 0) + 20), ("friction coefficient", "slip")),
    Effect("friction_rises_with_log_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.1,
           lambda s, v: 1 + s * (np.log1p(v / 0.8) - 2), ("friction coefficient", "slip")),
    Effect("pores_close", "torque", "friction_coefficient", "contact_pressure", "ratio", "1", 0.2,
           lambda s, p: 1 - s * (1 - np.exp(-(p / 5) ** 1.8)), ("friction coefficient", "pressure")),
    Effect("friction_peaks_in_pressure", "torque", "friction_coefficient", "contact_pressure", "ratio", "1", 0.15,
           lambda s, p: 1 + s * (p / 4) * np.exp(1 - p / 4) - 0.6 * s, ("friction coefficient", "pressure")),
    Effect("fade_above_a_heat", "torque", "friction_coefficient", "heat", "ratio", "1", 0.2,
           lambda s, e: 1 - s * np.tanh(np.maximum(e - 800, 0) / 3e3), ("friction coefficient", "heat")),
    Effect("heat_first_helps_then_fades", "torque", "friction_coefficient", "energy", "ratio", "1", 0.12,
           lambda s, e: 1 + s * (np.exp(-((e / 3e3 - 1) ** 2)) - np.clip(e / 1.2e4, 0, 1.2) ** 1.7),
           ("friction coefficient", "heat")),
    Effect("friction_builds_up_over_a_way", "torque", "friction_lag", "slip", "difference", "s", 0.03,
           lambda s, v: s * 15 / (v + 8), ("friction coefficient", "lag")),
    Effect("film_thins_in_steps", "torque", "film_coefficient", "sequence", "ratio", "1", 0.75,
           lambda s, r: (1 + np.tanh((r - 0.35) / 0.08)) * -0.5 * s + 1, ("film torque", "run order")),
    # Shafts
    Effect("shaft_coupling_stiffens", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 2.5e-4,
           lambda s, x: s / (1 + (x / 0.08) ** 0.8), ("stick torque", "twist")),
    Effect("rubber_coupling", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 1.5e-4,
           lambda s, x: s * (1 + 0.6 * np.tanh(x / 0.05)), ("stick torque", "twist")),
    Effect("oil_in_converter_is_slow", "input speed", "converter_lag", "input_speed", "difference", "s", 0.05,
           lambda s, w: s * (0.4 + 0.9 * np.exp(-w / 90)), ("converter torque", "lag")),
    Effect("load_churns", "output speed", "load_torque", "output_speed", "difference", "N m", 20.0,
           lambda s, w: s * (np.maximum(w - 15, 0) / 30) ** 1.3, ("load torque", "output speed")),
    Effect("load_drag_saturates", "output speed", "load_torque", "output_speed", "difference", "N m", 20.0,
           lambda s, w: s * (1 - np.exp(-np.maximum(w, 0) / 9)), ("load torque", "output speed")),
    Effect("brake_lets_go", "output speed", "brake_torque", "output_speed", "ratio", "1", 0.35,
           lambda s, w: 1 - s * (1 - np.exp(-np.maximum(w, 0) / 4)) * (1 - 0.4 * np.minimum(w / 60, 1)),
           ("load torque", "output speed")),
)
UNSEEN = (*UNSEEN_PHYSICAL, *UNSEEN_SENSORS, *UNSEEN_UNLISTED)
