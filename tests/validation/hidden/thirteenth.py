"""Effects that no other list has: `THIRTEENTH`, for the list `outlying` of cases.py, on benches from `drawn61` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: stairs, level
parts between two rises, soft steps, roots, roofs, pointed peaks, sawtooths, dips beside bumps, and steps that swing. No
earlier list has the form for the same pair.
"""

import numpy as np

from .effect import Effect
from .eleventh_shapes import comb, fork, settling
from .seventh_waves import root, skewed
from .tenth_shapes import crest
from .third import step
from .thirteenth_sensors import THIRTEENTH_SENSORS
from .thirteenth_shapes import stairs, treads
from .thirteenth_unlisted import THIRTEENTH_UNLISTED
from .twelfth_shapes import ramp, roof, swing

THIRTEENTH_PHYSICAL = (
    # Line pressure and valve
    # A shuttle valve takes the oil of a worn pump at low speeds, and that of a second pump at high ones
    Effect("shuttle_valve_changes_over_to_a_second_pump", "pressure", "pressure_gain", "motor_speed", "ratio", "1",
           0.06, lambda s, w: 1 + s * (np.maximum((172 - w) / 30, (w - 165) / 25) - 0.6)),
    # The domains of the magnet turn over in two avalanches
    Effect("domains_turn_over_in_two_avalanches", "pressure", "valve_current", "current_excess", "difference", "A",
           0.02, lambda s, i: -s * (0.6 * (step(i, 0.025, 0.003) - step(-i, 0.025, 0.003))
                                    + 0.7 * (step(i, 0.16, 0.01) - step(-i, 0.16, 0.01)))),
    # The lands are set closer than they should be, so that the gain is highest as the spool passes its middle
    Effect("lands_are_set_closer_than_drawn", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * root((u - 0.6) / 0.25, 0.03)),
    # Piston
    # Two dams in the drum hold back the oil ring, each up to its own speed
    Effect("oil_ring_fills_two_dams", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.6,
           lambda s, w: s * treads(w, (35, 60, 0.6), (140, 152, 0.8))),
    # The tap of the cooling water is closed in three turns
    Effect("cooling_tap_is_closed_in_three_turns", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * (stairs(r, (0.14, 0.6), (0.52, 0.7), (0.87, 1.3)) - 0.5)),
    # The hard skin of the linings is worn through in a few runs, below it they last again
    Effect("linings_lose_their_skin_in_the_middle", "torque", "clearance", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * (1.2 * step(r, 0.56, 0.03) - 0.3)),
    # A domed lid in the feed snaps over at a pressure: it gives oil before, and takes oil after it
    Effect("domed_lid_in_the_feed_snaps_over", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * 1.2 * swing(p, 5, 1.8)),
    # The cover dishes until its ribs meet the housing, which draws it back
    Effect("cover_dishes_until_its_ribs_meet_the_housing", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * (1.4 * roof(p, 1.5, 5, 11) - 0.3)),
    # A reed in the feed buzzes at one flow, and lets more oil pass there than beside it
    Effect("reed_in_the_feed_buzzes_at_a_flow", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.35,
           lambda s, v: 1 + s * (1.5 * crest(v, 0.0075, 0.0025, 0.004) - 0.4)),
    # The piston takes a loose spring plate along, which bounces on its springs
    Effect("loose_spring_plate_is_taken_along", "torque", "net_pressure", "piston", "difference", "bar", 1.2,
           lambda s, x: -s * settling(x, 0.0006, 0.0008, 0.0008)),
    # The first lip is pressed on at once, the second at a higher pressure; back only the first one rubs
    Effect("second_lip_is_pressed_on_later", "torque", "net_pressure", "driving_pressure", "difference", "bar", 1.0,
           lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(
               p > 0, treads(p, (0, 0.5, 0.2), (2.5, 3, 0.5), (6, 6.5, 0.9)), 0.4 * ramp(-p, 0, 0.5)))),
    # Plates
    # The lubrication follows the slip until its pump can give no more, and the plates run dry
    Effect("lubrication_follows_the_slip_up_to_its_limit", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 - s * (1.5 * roof(v, -4, 14, 46) - 0.6)),
    # The plates bear on their ribs, then on the ground between, and at last on the rim
    Effect("plates_bear_on_ribs_ground_and_rim", "torque", "friction_coefficient", "contact_pressure", "ratio", "1",
           0.15, lambda s, p: 1 + s * (treads(p, (4.6, 5.2, 0.8), (7.8, 8.6, 0.9)) - 0.8)),
    # Scale grows with the heat, and bursts off layer by layer
    Effect("scale_grows_and_bursts_off", "torque", "friction_coefficient", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 - s * skewed(np.maximum(h, 0) / 2600, 0.9)),
    # The grooves become shallow as the linings wear, and drain ever more slowly
    Effect("grooves_become_shallow", "torque", "friction_lag", "sequence", "difference", "s", 0.025,
           lambda s, r: s * (0.2 + 1.3 * ramp(r, 0.2, 0.85))),
    # Oil for rinsing was left behind; later the sump is filled up with a grade for gears
    Effect("rinsing_oil_is_followed_by_gear_oil", "torque", "film_coefficient", "sequence", "ratio", "1", 1.2,
           lambda s, r: 1 + s * 0.2 * (1 + swing(r, 0.45, 0.15))),
    # Shafts, converter and load
    # The spokes of the coupling are straightest, and hardest, at one twist
    Effect("coupling_spokes_are_straight_at_a_twist", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)",
           1.2e-4, lambda s, x: s * (0.25 + 0.75 * np.minimum(fork(np.maximum(x, 0) + 0.004, 0.04), 1.6))),
    # The hot oil of the plates lets out its air in the converter
    Effect("hot_oil_lets_out_its_air_in_the_converter", "input speed", "converter_lag", "heat", "difference", "s", 0.05,
           lambda s, h: s * (0.2 + 1.3 * (1 - np.exp(-((np.maximum(h, 0) / 1500) ** 2))))),
    # The chain to the load whips at several speeds
    Effect("chain_to_the_load_whips_at_several_speeds", "output speed", "load_torque", "output_speed", "difference",
           "N m", 30.0, lambda s, w: s * (1.5 * comb(w - 9, 15, 7) - 0.3)),
)
THIRTEENTH = (*THIRTEENTH_PHYSICAL, *THIRTEENTH_SENSORS, *THIRTEENTH_UNLISTED)
NEAR = {"shuttle_valve_changes_over_to_a_second_pump": (61, 62, 64, 71)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a formula of the catalogue, or just 10 %."""
LATE = ("heat", "contact_time", "output_speed", "output_position")
"""What has hardly any size on `drawn67`, whose plates touch just before they lock: there is no effect over it there."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(61, 73)
                              if number not in NEAR.get(effect.name, ())
                              and not (number == 67 and effect.abscissa in LATE))
           for effect in THIRTEENTH}
"""The benches on which a case may have each effect."""
