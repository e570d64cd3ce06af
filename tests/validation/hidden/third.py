"""Effects that neither the development list nor the final list has: `THIRD`, for the list `unseen` of cases.py.

Units and scales are those of catalogue.py. The forms are not monotone, have several steps or kinks, or are different
before and after an intervention.
"""

import numpy as np

from .effect import Effect
from .third_sensors import THIRD_SENSORS
from .third_unlisted import THIRD_UNLISTED


def step(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return a smooth step from 0 to 1 at `at`."""
    return 0.5 * (1 + np.tanh((x - at) / (2 * width)))


def bump(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return a smooth bump with height 1 at `at`."""
    return np.exp(-(((x - at) / width) ** 2))


THIRD_PHYSICAL = (
    # Line pressure and valve
    Effect("pump_resonates", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 - s * bump(w, 152, 24)),
    Effect("valve_holds_on_release", "pressure", "valve_play", "direction", "difference", "A", 0.015,
           lambda s, d: s * (1 - 0.7 * d)),
    Effect("some_plays_are_wide", "pressure", "valve_plays", "fraction", "difference", "A", 0.02,
           lambda s, x: s * np.where(x > 0.75, 4.0, 0.0)),
    Effect("magnet_attracts_beyond_a_change", "pressure", "valve_current", "current_excess", "difference", "A", 0.02,
           lambda s, i: -s * np.tanh((i / 0.035) ** 3)),
    Effect("valve_land_leaks", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: -s * (step(u, 0.36, 0.015) - 0.8 * step(u, 0.58, 0.02))),
    # Piston
    Effect("centrifugal_oil_spills", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.5,
           lambda s, w: s * (w / 95) ** 2 * np.exp(1 - (w / 95) ** 2)),
    Effect("oil_warms_in_two_sessions", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * np.where(r < 0.55, 1 - np.exp(-r / 0.2),
                                         0.75 * (1 - np.exp(-(np.maximum(r, 0.55) - 0.55) / 0.12)))),
    Effect("plates_are_exchanged", "torque", "clearance", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * np.where(r < 0.62, (np.maximum(r, 0) / 0.62) ** 1.4, 0.05 + 0.3 * (r - 0.62))),
    Effect("bubbles_collapse", "torque", "oil_temperature_gain", "pressure", "ratio", "1", 0.1,
           lambda s, p: 1 - s * step(-p, -4.0, 0.4)),
    Effect("plates_settle_in_two_stages", "torque", "clearance", "pressure", "ratio", "1", 0.08,
           lambda s, p: 1 + s * (0.55 * step(p, 3.2, 0.3) + 0.45 * step(p, 9.0, 0.5))),
    Effect("feed_chokes", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.25,
           lambda s, v: 1 - s * (step(np.abs(v), 0.0055, 0.0005) - 0.5 * step(np.abs(v), 0.012, 0.0008))),
    Effect("return_springs_catch", "torque", "net_pressure", "piston", "difference", "bar", 0.8,
           lambda s, x: -s * (bump(x, 0.0011, 0.0003) + 0.6 * step(x, 0.0017, 0.00008))),
    Effect("spring_passes_a_dead_point", "torque", "spring_rate", "piston", "ratio", "1", 1.0,
           lambda s, x: 1 + s * (bump(x, 0.0013, 0.0004) - 0.7 * bump(x, 0.0021, 0.0003))),
    Effect("seal_breaks_loose", "torque", "net_pressure", "driving_pressure", "difference", "bar", 2.0,
           lambda s, p: -s * np.tanh(p / 0.25) * (0.2 + 0.8 * np.exp(-np.abs(p) / 1.2))),
    # Plates
    Effect("friction_falls_in_two_steps", "torque", "friction_coefficient", "slip", "ratio", "1", 0.2,
           lambda s, v: 1 + s * (0.4 * step(-v, -5, 0.5) + 0.6 * step(-v, -30, 1.0))),
    Effect("friction_rises_from_a_knee", "torque", "friction_coefficient", "slip", "ratio", "1", 0.2,
           lambda s, v: 1 + s * np.clip((v - 16) / 9, 0, 1)),
    Effect("friction_dips_at_a_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.2,
           lambda s, v: 1 - s * bump(v, 17, 8)),
    Effect("lining_compresses", "torque", "friction_coefficient", "contact_pressure", "ratio", "1", 0.15,
           lambda s, p: 1 - s * step(p, 5.6, 0.35)),
    Effect("friction_has_a_valley_in_pressure", "torque", "friction_coefficient", "contact_pressure", "ratio", "1",
           0.2, lambda s, p: 1 - s * bump(np.log(np.maximum(p, 0.1) / 5.5), 0.0, 0.25)),
    Effect("moisture_boils_off", "torque", "friction_coefficient", "energy", "ratio", "1", 0.15,
           lambda s, e: 1 + s * (step(e, 4.0e3, 500) - 0.7 * step(e, 1.0e4, 700))),
    Effect("fade_recovers_in_part", "torque", "friction_coefficient", "heat", "ratio", "1", 0.2,
           lambda s, h: 1 - s * (step(h, 1.4e3, 120) - 0.6 * step(h, 3.6e3, 200))),
    Effect("friction_builds_up_when_pressed_lightly", "torque", "friction_lag", "contact_pressure", "difference", "s",
           0.025, lambda s, p: s * (0.15 + 1.6 * step(-p, -5.5, 0.4))),
    Effect("oil_is_topped_up", "torque", "film_coefficient", "sequence", "ratio", "1", 2.5,
           lambda s, r: np.exp(-s * np.where(r < 0.5, 2 * r, 0.2))),
    # Shafts
    Effect("splines_have_backlash", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 2e-4,
           lambda s, x: s * (0.35 + 2.0 * np.exp(-x / 0.03))),
    Effect("converter_fills_slowly", "input speed", "converter_lag", "input_speed", "difference", "s", 0.05,
           lambda s, w: s * (0.25 + 1.5 * bump(w, 115, 28))),
    Effect("load_drag_has_a_peak", "output speed", "load_torque", "output_speed", "difference", "N m", 20.0,
           lambda s, w: s * np.maximum(w, 0) / 8 * np.exp(1 - np.maximum(w, 0) / 8)),
    Effect("brake_fades_in_a_band", "output speed", "brake_torque", "output_speed", "ratio", "1", 0.35,
           lambda s, w: 1 - s * bump(w, 14, 6)),
)
THIRD = (*THIRD_PHYSICAL, *THIRD_SENSORS, *THIRD_UNLISTED)
