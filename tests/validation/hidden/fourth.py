"""Effects that no other list has: `FOURTH`, for the list `elsewhere` of cases.py, on the bench `brisk` only.

Units and scales are those of catalogue.py. The forms are piecewise linear with bands and flat parts, rational with a
peak, logarithms and odd powers, bumps over a logarithm, and steps that recover.
"""

import numpy as np

from .effect import Effect
from .fourth_sensors import FOURTH_SENSORS
from .fourth_unlisted import FOURTH_UNLISTED


def above(x: np.ndarray, least: float) -> np.ndarray:
    """Return by how much `x` is above a threshold, at least 0."""
    return np.maximum(x - least, 0)


def log_bump(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return a bump over the logarithm of `x`, with height 1 at `at`."""
    return np.exp(-((np.log(np.maximum(x, 1e-3 * at) / at) / width) ** 2))


FOURTH_PHYSICAL = (
    # Line pressure and valve
    Effect("pump_is_best_in_a_band", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 + s * np.interp(w, [100, 132, 164, 200], [-1.0, 0.4, 0.4, -0.8])),
    Effect("valve_hangs_when_opening", "pressure", "valve_play", "direction", "difference", "A", 0.02,
           lambda s, d: s * (0.55 + 0.45 * d)),
    Effect("plays_are_spread_widely", "pressure", "valve_plays", "fraction", "difference", "A", 0.04,
           lambda s, x: s * 1.3 * 20 ** (np.minimum(x, 1) - 1)),
    Effect("magnet_relaxes_after_small_changes", "pressure", "valve_current", "current_excess", "difference", "A",
           0.02, lambda s, i: -s * 2 * (i / 0.06) / (1 + (i / 0.06) ** 2)),
    Effect("magnet_pole_has_flats", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * np.interp(u, [0.2, 0.36, 0.44, 0.6, 0.75], [0, -1.0, -1.0, 0.3, -0.5])),
    # Piston
    Effect("rotating_oil_fills_a_groove", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.5,
           lambda s, w: s * np.interp(w, [55, 105, 150, 200], [0, 0.9, 1.0, 0.35])),
    Effect("oil_is_renewed", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 - s * np.where(r < 0.38, 0, np.exp(-(np.maximum(r, 0.38) - 0.38) / 0.22))),
    Effect("plates_warp_for_a_while", "torque", "clearance", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * np.where((r > 0.27) & (r < 0.71), 1.0, 0.0)),
    Effect("foam_yields_in_between", "torque", "oil_temperature_gain", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 - s * log_bump(p, 3.4, 0.45)),
    Effect("housing_bends", "torque", "clearance", "pressure", "ratio", "1", 0.1,
           lambda s, p: 1 + s * np.minimum(above(p, 2.2) / 4, 2.5) ** 1.35),
    Effect("feed_is_starved_by_and_by", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.3,
           lambda s, v: 1 - s * (1 - np.exp(-((np.maximum(v, 0) / 0.008) ** 3)))),
    Effect("bubbles_burst", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s / (1 + (np.maximum(p, 0) / 2.8) ** 4)),
    Effect("disc_spring_presses", "torque", "net_pressure", "piston", "difference", "bar", 0.9,
           lambda s, x: -s * np.polyval([1.9, -4.1, 3.0, 0], np.clip(x / 0.002, 0, 1.25))),
    Effect("seal_rubs_softly", "torque", "net_pressure", "driving_pressure", "difference", "bar", 0.8,
           lambda s, p: -s * np.arctan(p / max(0.7 * s, 1e-9)) * 2 / np.pi * (1 + np.abs(p) / 12)),
    # Plates
    Effect("friction_is_flat_then_falls", "torque", "friction_coefficient", "slip", "ratio", "1", 0.2,
           lambda s, v: 1 + s * np.interp(v, [0, 7, 24, 60], [0.9, 0.9, -0.1, -0.35])),
    Effect("friction_is_high_at_a_small_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.2,
           lambda s, v: 1 + s * log_bump(v + 0.3, 6, 0.8)),
    Effect("lining_holds_at_first", "torque", "friction_coefficient", "contact_pressure", "ratio", "1", 0.15,
           lambda s, p: 1 + s * (1 - np.minimum(above(p, 3.5) / 5, 1.6) ** 1.4)),
    Effect("resin_softens", "torque", "friction_coefficient", "heat", "ratio", "1", 0.2,
           lambda s, h: 1 - s * np.maximum(h, 0) ** 2 / (np.maximum(h, 0) ** 2 + 2.2e3**2)),
    Effect("plates_dry_then_glow", "torque", "friction_coefficient", "energy", "ratio", "1", 0.15,
           lambda s, e: 1 + s * np.interp(e, [0, 2.5e3, 7e3, 1.6e4], [-0.6, 0.4, 0.4, -0.8])),
    Effect("friction_needs_its_time_at_speed", "torque", "friction_lag", "slip", "difference", "s", 0.025,
           lambda s, v: s * (0.2 + (np.maximum(v, 0) / 28) ** 1.4)),
    Effect("film_oil_is_sheared_down", "torque", "film_coefficient", "sequence", "ratio", "1", 1.5,
           lambda s, r: 1 / (1 + s * np.maximum(r, 0) ** 0.6)),
    # Shafts, converter and load
    Effect("coupling_has_three_stages", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 2e-4,
           lambda s, x: s * np.interp(x, [0, 0.03, 0.05, 0.14], [1.7, 1.7, 0.8, 0.45])),
    Effect("converter_turns_over_slowly", "input speed", "converter_lag", "motor_speed", "difference", "s", 0.05,
           lambda s, w: s * (0.35 + 1.5 * np.clip((165 - w) / 55, 0, 1))),
    Effect("load_bearing_has_a_minimum", "output speed", "load_torque", "output_speed", "difference", "N m", 20.0,
           lambda s, w: s * (1.1 * np.exp(-np.maximum(w, 0) / 5) + (np.maximum(w, 0) / 45) ** 0.8)),
    Effect("brake_shoes_wedge", "output speed", "brake_torque", "output_speed", "ratio", "1", 0.35,
           lambda s, w: 1 + s * 2.2 * (np.maximum(w, 0) / 18) ** 1.5 / (1 + (np.maximum(w, 0) / 18) ** 3)),
)
FOURTH = (*FOURTH_PHYSICAL, *FOURTH_SENSORS, *FOURTH_UNLISTED)
