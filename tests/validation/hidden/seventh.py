"""Effects that no other list has: `SEVENTH`, for the list `further` of cases.py.

Units and scales are those of catalogue.py. The forms follow from damage and faults of machines: cusps, broken powers,
skewed and chirped waves, rectified waves and pulses, wells between two slopes, responses to an unbalance, forms that
end at a point, telegraphs, and stuck bits.
"""

import numpy as np

from .effect import Effect
from .seventh_sensors import SEVENTH_SENSORS
from .seventh_unlisted import SEVENTH_UNLISTED
from .seventh_waves import root, skewed

SEVENTH_PHYSICAL = (
    # Line pressure and valve
    Effect("pump_is_worn_and_cavitates", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 - s * (1.2 * (100 / w) ** 3 + (w / 190) ** 7 - 0.5)),
    Effect("eddy_currents_shield_the_magnet", "pressure", "valve_current", "current_excess", "difference", "A", 0.02,
           lambda s, i: -s * root(i / 0.06, 0.1)),
    Effect("spool_sticks_at_a_worn_notch", "pressure", "valve_current", "current", "difference", "A", 0.025,
           lambda s, u: -s * (np.exp(-np.hypot(u - 0.44, 0.02) / 0.05)
                              - 0.6 * np.exp(-np.hypot(u - 0.6, 0.02) / 0.06))),
    # Piston
    Effect("oil_ring_whirls", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.5,
           lambda s, w: s * np.sin(2 * np.pi * (w / 130) ** 2)),
    Effect("cooler_fan_cuts_in_and_out", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * (1.7 * r - 0.1)))),
    Effect("linings_swell_with_water_overnight", "torque", "clearance", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 - s * np.maximum(np.sin(2 * np.pi * (2.1 * r + 0.15)), 0)),
    Effect("gas_dissolves_and_hose_stretches", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * np.expm1((2.5 - np.maximum(p, 0)) / 3) ** 2),
    Effect("seal_lip_flutters", "torque", "oil_temperature_gain", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * skewed(p / 6.5, 0.8)),
    Effect("splines_let_the_plates_go", "torque", "clearance", "pressure", "ratio", "1", 0.1,
           lambda s, p: 1 + s * root((p - 5) / 6, 0.02)),
    Effect("feed_line_hammers", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.3,
           lambda s, v: 1 + s * np.cos(2 * np.pi * v / 0.02) * np.exp(-((v / 0.016) ** 2))),
    Effect("bore_is_scored_in_rings", "torque", "net_pressure", "piston", "difference", "bar", 0.8,
           lambda s, x: -s * (np.sin(x / 0.00019) + 0.6 * np.sin(x / 0.00008 + 1)) / 1.3),
    Effect("backup_ring_is_extruded", "torque", "net_pressure", "driving_pressure", "difference", "bar", 1.0,
           lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * (0.3 + np.minimum(np.abs(p) / 5, 2) ** 2))),
    # Plates
    Effect("warped_plates_touch_by_turns", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 + s * skewed(v / 26, 0.85)),
    Effect("glazed_spots_grip_at_a_small_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.2,
           lambda s, v: 1 + s * (np.maximum(1 - (v / 22) ** 2, 0) ** 0.5 - 0.4)),
    Effect("asperities_lock_and_are_crushed", "torque", "friction_coefficient", "contact_pressure", "ratio", "1", 0.15,
           lambda s, p: 1 + s * (1.1 - 1.6 * np.sqrt(np.abs(p - 6.5) / 5))),
    Effect("oil_boils_in_the_grooves", "torque", "friction_coefficient", "heat", "ratio", "1", 0.2,
           lambda s, h: 1 + s * (np.minimum(np.maximum(h, 1) / 1500, (1500 / np.maximum(h, 1)) ** 0.8) ** 3 - 0.3)),
    Effect("film_is_squeezed_out_by_pressure", "torque", "friction_lag", "contact_pressure", "difference", "s", 0.025,
           lambda s, p: s * (0.15 + (4.5 / np.maximum(p, 2.5)) ** 3)),
    Effect("foam_comes_in_waves", "torque", "film_coefficient", "sequence", "ratio", "1", 1.2,
           lambda s, r: 1 + s * np.cos(2.6 * np.pi * (r - 0.1)) ** 8),
    # Shafts, converter and load
    Effect("flange_bolts_lift", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 2e-4,
           lambda s, x: s * (0.35 + 1.2 * np.sqrt(np.clip((x - 0.03) / 0.07, 0, 3)))),
    Effect("stator_freewheel_chatters", "input speed", "converter_lag", "input_speed", "difference", "s", 0.05,
           lambda s, w: s * (0.3 + 1.5 * np.maximum(1 - ((w - 112) / 42) ** 2, 0))),
    Effect("drum_whirls_at_its_critical_speed", "output speed", "load_torque", "output_speed", "difference", "N m",
           20.0, lambda s, w: s * 0.7 * (w / 17) ** 2 / np.hypot(1 - (w / 17) ** 2, 0.45 * w / 17)),
)
SEVENTH = (*SEVENTH_PHYSICAL, *SEVENTH_SENSORS, *SEVENTH_UNLISTED)
OTHERS = ("heavy", "compact", "light")
BENCHES = {effect.name: ("slow", OTHERS[i % 3]) for i, effect in enumerate(SEVENTH)}
"""The two benches on which a case may have each effect."""
