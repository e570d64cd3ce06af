"""Effects that no other list has: `SIXTH`, for the list `later` of cases.py.

Units and scales are those of catalogue.py. The forms are special functions (error and gamma functions, Bessel,
Fresnel and exponential integrals, Lambert's W, Planck's law, inverse hyperbolic functions), catenaries, half-sine arcs,
asymmetric resonances, and splines through the points of an invented measurement.
"""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import erf, erfc, exp1, fresnel, gammainc, j0, j1

from .effect import Effect
from .sixth_sensors import SIXTH_SENSORS
from .sixth_unlisted import SIXTH_UNLISTED

MAGNET = CubicSpline([0.2, 0.33, 0.42, 0.55, 0.68, 0.8], [0, -0.9, 0.4, -0.5, 0.9, 0.1])
DISC = CubicSpline([0, 4, 10, 19, 31, 46, 64], [0.2, 1.0, -0.5, 0.5, -0.4, -0.7, -0.1])


def asymmetric(x: np.ndarray, at: float, width: float) -> np.ndarray:
    """Return a resonance on a background: about -0.8 just before it, 1.2 just after it, 0 far away."""
    e = (x - at) / width
    return ((1.2 + e) ** 2 / (1 + e**2) - 1) / 1.2


SIXTH_PHYSICAL = (
    # Line pressure and valve
    Effect("suction_pipe_resonates_with_the_pump", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.05,
           lambda s, w: 1 + s * asymmetric(w, 152, 14)),
    Effect("magnet_creeps_by_thermal_steps", "pressure", "valve_current", "current_excess", "difference", "A", 0.02,
           lambda s, i: -s * np.arcsinh(i / 0.008) / 3.5),
    Effect("jet_turns_as_the_land_opens", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * MAGNET(np.clip(u, 0.2, 0.8))),
    # Piston
    Effect("oil_ring_breaks_up_at_a_speed", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.5,
           lambda s, w: s * (1 - 2 / np.cosh((w - 115) / 14))),
    Effect("thermostat_of_the_oil_hunts", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * (2 * fresnel(2.6 * r)[0] - 0.5)),
    Effect("plates_bed_in_with_setbacks", "torque", "clearance", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * (1 - j0(11 * r))),
    Effect("accumulator_membrane_gives", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * np.maximum(p, 0) / (1 + np.maximum(p, 0) + (np.maximum(p, 0) / 3) ** 3)),
    Effect("piston_stands_square_under_pressure", "torque", "oil_temperature_gain", "pressure", "ratio", "1", 0.15,
           lambda s, p: 1 - s * (1 - gammainc(3, np.maximum(p, 0) / 1.6))),
    Effect("drum_breathes", "torque", "clearance", "pressure", "ratio", "1", 0.1,
           lambda s, p: 1 + s * 1.7 * j1(np.maximum(p, 0) / 2)),
    Effect("feed_bore_cavitates_in_a_band", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.35,
           lambda s, v: 1 - s * np.sin(np.pi * np.clip(v / 0.011, 0, 1))),
    Effect("springs_sit_in_a_bowl", "torque", "net_pressure", "piston", "difference", "bar", 0.8,
           lambda s, x: s * (1 - (np.cosh((np.clip(x, 0, 0.0024) - 0.001) / 0.0005) - 1) / 2.5)),
    Effect("seal_rolls_in_its_groove", "torque", "net_pressure", "driving_pressure", "difference", "bar", 1.2,
           lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.sin(np.pi * np.clip(np.abs(p) / 7, 0, 1)))),
    # Plates
    Effect("boundary_film_breaks", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 + s * (erfc((v - 20) / 6) - 0.8)),
    Effect("friction_is_that_of_another_disc", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 + s * DISC(np.clip(v, 0, 64))),
    Effect("fibres_grip_between_two_pressures", "torque", "friction_coefficient", "contact_pressure", "ratio", "1",
           0.15, lambda s, p: 1 + s * (erf((p - 3.5) / 0.8) - erf((p - 7.5) / 1.2) - 1)),
    Effect("resin_gives_off_gas", "torque", "friction_coefficient", "heat", "ratio", "1", 0.2,
           lambda s, h: 1 - s * 0.7 * (np.maximum(h, 1) / 600) ** 3 / np.expm1(np.clip(h, 1, 6e4) / 600)),
    Effect("plates_are_drained_by_capillaries", "torque", "friction_lag", "contact_time", "difference", "s", 0.025,
           lambda s, t: s * (0.3 + 0.6 * exp1(np.maximum(t, 0) / 0.25 + 0.03))),
    Effect("film_oil_foams_by_and_by", "torque", "film_coefficient", "sequence", "ratio", "1", 1.2,
           lambda s, r: 1 + s * np.exp(-14 * np.exp(-7 * r))),
    # Shafts, converter and load
    Effect("coupling_pads_touch", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 2e-4,
           lambda s, x: s * (0.4 + 0.65 * erfc((x - 0.05) / 0.015))),
    Effect("stator_lets_go_slowly", "input speed", "converter_lag", "input_speed", "difference", "s", 0.05,
           lambda s, w: s * (0.3 + 1.3 * (0.5 + np.arctan((110 - w) / 8) / np.pi))),
    Effect("load_blower_surges", "output speed", "load_torque", "output_speed", "difference", "N m", 20.0,
           lambda s, w: s * 3.3 * j1(np.maximum(w, 0) / 8) ** 2),
)
SIXTH = (*SIXTH_PHYSICAL, *SIXTH_SENSORS, *SIXTH_UNLISTED)
OTHERS = ("heavy", "brisk", "giant")
BENCHES = {effect.name: ("light", OTHERS[i % 3]) for i, effect in enumerate(SIXTH)}
"""The two benches on which a case may have each effect."""
