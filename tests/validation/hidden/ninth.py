"""Effects that no other list has: `NINTH`, for the list `abroad` of cases.py, on the drawn benches from `drawn13` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: soft steps,
rounded knees, humps with a steep front, flat wells, powers with odd exponents, saturations, and thresholds.
"""

import numpy as np

from .effect import Effect
from .ninth_sensors import NINTH_SENSORS
from .ninth_shapes import burr, edge, hinge, hump
from .ninth_unlisted import NINTH_UNLISTED

NINTH_PHYSICAL = (
    # Line pressure and valve
    Effect("unloading_valve_hangs_between_two_speeds", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 + s * (0.8 - 1.4 * edge(w, 138, 5) + 1.1 * edge(w, 178, 4))),
    Effect("armature_sticks_to_its_plate_on_release", "pressure", "valve_current", "current_excess", "difference", "A",
           0.02, lambda s, i: s * ((1 - np.exp(-np.maximum(-i, 0) / 0.02)) ** 2
                                   - 0.7 * (1 - np.exp(-np.maximum(i, 0) / 0.05)) ** 3)),
    Effect("spool_has_notches_of_three_depths", "pressure", "valve_current", "current", "difference", "A", 0.025,
           lambda s, u: s * (1.1 * burr(u, 0.31, 0.015, 0.1) + 0.8 * burr(u, 0.47, 0.015, 0.07)
                               + burr(u, 0.62, 0.015, 0.06) - 0.2)),
    # Piston
    Effect("oil_ring_spills_over_its_dam", "torque", "chamber_pressure", "input_speed", "difference", "bar",
           0.5, lambda s, w: s * 1.4 * burr(w, 92, 8, 60)),
    Effect("oil_cooler_clogs_from_some_run_on", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.15,
           lambda s, r: 1 + s * (2.9 * hinge(r, 0.62, 0.04) - 0.25)),
    Effect("linings_swell_in_fresh_oil_and_wear_down", "torque", "clearance", "sequence", "ratio", "1", 0.2,
           lambda s, r: 1 + s * (1.4 * hump(r, 0.13, 1.2) - 0.4)),
    Effect("foam_behind_the_seal_is_set_free", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * hump(p, 4.5, 3.4)),
    Effect("retaining_ring_climbs_out_of_its_groove", "torque", "clearance", "pressure", "ratio", "1", 0.15,
           lambda s, p: 1 + s * np.expm1(np.clip(p, 0, 18) / 3.2) / 15),
    Effect("flap_in_the_feed_tilts", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.4,
           lambda s, v: 1 + s * (1.1 * hump(v, 0.0045, 2.2) - 0.3)),
    Effect("piston_rubs_on_a_ledge_of_its_bore", "torque", "net_pressure", "piston", "difference", "bar", 1.0,
           lambda s, x: -s * burr(x, 0.0011, 0.00008, 0.0006)),
    Effect("seal_is_energized_above_a_pressure", "torque", "net_pressure", "driving_pressure", "difference", "bar", 1.0,
           lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(p > 0, 0.1 + 1.3 * edge(p, 4.5, 0.5), 0.35))),
    # Plates
    Effect("oil_wedge_carries_the_plates_in_between", "torque", "friction_coefficient", "slip", "ratio", "1", 0.2,
           lambda s, v: 1 - s * (edge(v, 8, 1.2) - 0.9 * edge(v, 29, 2) - 0.2)),
    Effect("lining_carries_by_its_rim_until_it_seats", "torque", "friction_coefficient", "contact_pressure", "ratio",
           "1", 0.15, lambda s, p: 1 + s * (0.9 * np.exp(-((p / 2.6) ** 3)) + edge(p, 7.5, 0.5) - 0.5)),
    Effect("vapour_lifts_the_plates_until_they_are_dry", "torque", "friction_coefficient", "heat", "ratio", "1", 0.08,
           lambda s, h: 1 + s * (np.minimum(hinge(h, 2200, 150) / 1500, 1.4) - 1.1 * hump(h, 900, 1.7))),
    Effect("grooves_drain_only_below_a_slip", "torque", "friction_lag", "slip", "difference", "s", 0.025,
           lambda s, v: s * (0.15 + 1.5 * edge(-v, -16, 1.5))),
    Effect("film_oil_is_thick_when_fresh_and_when_old", "torque", "film_coefficient", "sequence", "ratio", "1", 1.2,
           lambda s, r: 1 + s * (np.exp(-((r / 0.13) ** 1.4)) + 0.9 * np.clip(r, 0, 1) ** 9)),
    # Shafts, converter and load
    Effect("rubber_pads_are_torn_from_their_plate", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)",
           1.5e-4, lambda s, x: s * (0.2 + 1.5 * x**3.3 / (x**3.3 + 0.06**3.3))),
    Effect("charge_oil_is_short_while_the_clutch_slips", "input speed", "converter_lag", "slip", "difference", "s",
           0.05, lambda s, v: s * (0.2 + 1.2 * edge(v, 24, 2))),
    Effect("load_fan_engages_at_a_speed", "output speed", "load_torque", "output_speed", "difference", "N m", 30.0,
           lambda s, w: s * burr(w, 9, 0.8, 16)),
)
NINTH = (*NINTH_PHYSICAL, *NINTH_SENSORS, *NINTH_UNLISTED)
NEAR = {"unloading_valve_hangs_between_two_speeds": (13, 24), "rubber_pads_are_torn_from_their_plate": (19,),
        "pressure_port_is_full_of_grease": (17, 21), "output_speed_recorder_has_a_slow_clock": (13, 16, 22)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a formula of the catalogue, or just 10 %."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(13, 25) if number not in NEAR.get(effect.name, ()))
           for effect in NINTH}
"""The benches on which a case may have each effect."""
