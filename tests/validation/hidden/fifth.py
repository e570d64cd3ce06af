"""Effects that no other list has: `FIFTH`, for the list `fresh` of cases.py.

Units and scales are those of catalogue.py. The forms are passages through a resonance, polynomials with turning points,
log-periodic and damped waves, sawtooths, and smooth bends between two straight lines.
"""

import numpy as np

from .effect import Effect
from .fifth_sensors import FIFTH_SENSORS
from .fifth_unlisted import FIFTH_UNLISTED


def passage(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return the response in phase when a resonance is passed: -1 before it, 0 at it, 1 after it, 0 far away."""
    return 2 * (x - at) * width / ((x - at) ** 2 + width**2)


def bend(x: np.ndarray, at: float, width: float, rounding: float) -> np.ndarray:
    """Return a rounded V over `x` in units of `width`."""
    return np.sqrt(((x - at) / width) ** 2 + rounding**2)


FIFTH_PHYSICAL = (
    # Line pressure and valve
    Effect("pump_passes_a_resonance", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 + s * passage(w, 152, 17)),
    Effect("plays_leave_a_free_path", "pressure", "valve_plays", "fraction", "difference", "A", 0.05,
           lambda s, x: s * 5 * np.maximum(x - 0.4, 0)),
    Effect("magnet_lags_while_it_opens", "pressure", "valve_current", "current_excess", "difference", "A", 0.02,
           lambda s, i: -s * np.logaddexp(0, (i - 0.04) / 0.02) * 0.05),
    Effect("spool_forces_turn_over", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * np.polyval([4, 0, -3, 0], np.clip((u - 0.46) / 0.32, -1.1, 1.1))),
    # Piston
    Effect("oil_ring_balances_at_a_speed", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.5,
           lambda s, w: s * passage(w, 110, 30)),
    Effect("oil_warms_and_is_cooled", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * 6.75 * r**2 * np.maximum(1 - r, 0)),
    Effect("slack_is_taken_up_by_a_ratchet", "torque", "clearance", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * np.mod(2.7 * r, 1.0)),
    Effect("feed_hose_swells", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * np.maximum(p, 0) ** 2 / (np.maximum(p, 0) ** 2 + 25)),
    Effect("ring_seal_opens_and_closes", "torque", "oil_temperature_gain", "pressure", "ratio", "1", 0.3,
           lambda s, p: 1 + s * (np.exp(-np.maximum(p, 0) / 9) - 1.6 * np.exp(-np.maximum(p, 0) / 2.5))),
    Effect("waved_plates_spring", "torque", "clearance", "pressure", "ratio", "1", 0.1,
           lambda s, p: 1 - s * (1 - (p / 6) ** 2) * np.exp(-((p / 6) ** 2) / 2)),
    Effect("check_valve_opens_at_a_flow", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.25,
           lambda s, v: 1 - s / (1 + (v / 0.006) ** 2)),
    Effect("piston_snaps_over_a_detent", "torque", "net_pressure", "piston", "difference", "bar", 0.9,
           lambda s, x: -s * passage(x, 0.0014, 0.0003)),
    Effect("seal_rubs_near_balance", "torque", "net_pressure", "driving_pressure", "difference", "bar", 1.5,
           lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s / (1 + (np.abs(p) / 5) ** 3))),
    # Plates
    Effect("friction_turns_with_the_logarithm_of_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 + s * np.cos(2.2 * np.log((v + 1) / 4))),
    Effect("grooves_pass_each_other", "torque", "friction_coefficient", "slip", "ratio", "1", 0.2,
           lambda s, v: 1 + s * np.sinc(v / 17)),
    Effect("lining_is_weakest_at_a_pressure", "torque", "friction_coefficient", "contact_pressure", "ratio", "1", 0.15,
           lambda s, p: 1 + s * (bend(p, 8, 3, 0.3) - 0.9)),
    Effect("resin_passes_a_transition", "torque", "friction_coefficient", "heat", "ratio", "1", 0.2,
           lambda s, h: 1 - s * passage(h, 2.2e3, 700)),
    Effect("third_body_comes_and_goes", "torque", "friction_coefficient", "energy", "ratio", "1", 0.15,
           lambda s, e: 1 + s * np.cos(2 * np.pi * e / 8e3) * np.exp(-np.maximum(e, 0) / 2e4)),
    Effect("friction_lags_until_the_plates_are_wiped", "torque", "friction_lag", "contact_time", "difference", "s",
           0.025, lambda s, t: s * (0.3 + 1.8 / (1 + (np.maximum(t, 0) / 0.22) ** 3))),
    Effect("film_oil_is_thickest_in_between", "torque", "film_coefficient", "sequence", "ratio", "1", 1.2,
           lambda s, r: 1 + s * 4 * r * np.maximum(1 - r, 0)),
    # Shafts, converter and load
    Effect("coupling_is_soft_at_a_twist", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 2e-4,
           lambda s, x: s * (0.5 + 1.3 / (1 + ((x - 0.05) / 0.02) ** 2))),
    Effect("converter_has_run_empty", "input speed", "converter_lag", "time", "difference", "s", 0.05,
           lambda s, t: s * (0.35 + 1.5 / (1 + (np.maximum(t, 0) / 0.45) ** 4))),
    Effect("load_pump_turns_over", "output speed", "load_torque", "output_speed", "difference", "N m", 20.0,
           lambda s, w: s * np.polyval([3.2, -6.4, 3.4, 0], np.clip(w / 36, 0, 1.4))),
    Effect("brake_squeals", "output speed", "brake_torque", "output_speed", "ratio", "1", 0.35,
           lambda s, w: 1 + s * 0.9 * np.sin(2 * np.pi * np.maximum(w, 0) / 24)),
)
FIFTH = (*FIFTH_PHYSICAL, *FIFTH_SENSORS, *FIFTH_UNLISTED)
BENCHES = {effect.name: ("giant", ("heavy", "compact")[i % 2]) for i, effect in enumerate(FIFTH)}
"""The two benches on which a case may have each effect."""
