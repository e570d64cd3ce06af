"""Effects that no other list has: `SIXTEENTH`, for the list `polar` of cases.py, on benches from `drawn97` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: peaks behind
slits, bonds, fins, absorbers, roughness at all scales, rippling squares, recoils, waves that crowd at two ends or about
a middle, and echoes.
"""

import numpy as np

from .effect import Effect
from .sixteenth_sensors import SIXTEENTH_SENSORS
from .sixteenth_shapes import absorber, bond, crowded, echoes, fins, overtones, recoil, rough, slits, winds
from .sixteenth_unlisted import SIXTEENTH_UNLISTED
from .twelfth_shapes import ramp

SIXTEENTH_PHYSICAL = (
    # Line pressure and valve
    # A side branch of the line takes the pulses at the speed that it is tuned to, and rings at the next
    Effect("side_branch_of_the_line_rings_beside_its_speed", "pressure", "pressure_gain", "motor_speed", "ratio", "1",
           0.06, lambda s, w: 1 + s * absorber(w, 147, 177, 6)),
    # Barbs on the guide catch the armature on its way up, each less than the one before
    Effect("barbs_on_the_guide_catch_the_armature", "pressure", "valve_current", "current_excess", "difference", "A",
           0.02, lambda s, i: s * (0.3 - 1.3 * echoes(i, 0.035, 0.085, 0.8, 0.024))),
    # The grooves of the spool crowd at both ends of its stroke
    Effect("grooves_of_the_spool_crowd_at_its_ends", "pressure", "valve_current", "current", "difference", "A", 0.018,
           lambda s, u: s * crowded(u, -0.08, 1.05, 12)),
    # Piston
    # The oil ring breaks over rims of the drum, at speeds that are evenly spaced, and ever less
    Effect("oil_ring_breaks_over_rims_of_the_drum", "torque", "chamber_pressure", "input_speed", "difference", "bar",
           0.6, lambda s, w: s * (1.4 * echoes(w, 58, 46, 0.8, 14) - 0.3)),
    # A bypass is opened on a line that was cold, whose oil comes before the warm one
    Effect("cold_oil_of_a_bypass_comes_before_the_warm_one", "torque", "oil_temperature_gain", "sequence", "ratio", "1",
           0.12, lambda s, r: 1 + s * (1.2 * recoil(r, 0.28, 0.12) - 0.2)),
    # Debris of all sizes builds up between the plates, and leaves again
    Effect("debris_of_all_sizes_comes_and_goes", "torque", "clearance", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * (1.6 * rough(r + 0.09, 0.62) - 0.6)),
    # A shutter in front of a hose claps to and fro as the pressure rises, and rings
    Effect("shutter_in_the_feed_claps_and_rings", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * (1 + 0.9 * overtones(p - 0.6, 6.4))),
    # The teeth of three plates meet at some pressures, and pass each other in between
    Effect("teeth_of_three_plates_meet_at_some_pressures", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * (1.5 * slits(p - 5.2, 4.7, 3) - 0.4)),
    # A blind pipe on the feed takes the flow that it is tuned to, and gives at the next; resistances differ by a power
    Effect("blind_pipe_on_the_feed_is_tuned_to_a_flow", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.3,
           lambda s, v: (1 + s) ** (0.9 * absorber(v, 0.0045, 0.0105, 0.0009))),
    # The bore was bored with a blunt tool, and is rough at all scales
    Effect("bore_was_bored_with_a_blunt_tool", "torque", "net_pressure", "piston", "difference", "bar", 1.2,
           lambda s, x: -s * 1.3 * rough(x, 0.0017)),
    # The lip rolls over and back between two pressures on the way out; on the way back it is drawn on
    Effect("seal_lip_rolls_over_and_back", "torque", "net_pressure", "driving_pressure", "difference", "bar", 1.0,
           lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(
               p > 0, 0.75 + 0.6 * winds(p, 4.2, 2.4, 2), 0.4 * ramp(-p, 0, 0.8)))),
    # Plates
    # The plates are bound by their film, drawn out of it with the slip, and dragged beyond
    Effect("plates_are_bound_by_their_film", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 + s * (1.3 * bond(v, 15, 12) - 0.6)),
    # The ribs of the lining crowd at both its rims, which are pressed flat first and last
    Effect("ribs_of_the_lining_crowd_at_its_rims", "torque", "friction_coefficient", "contact_pressure", "ratio", "1",
           0.12, lambda s, p: 1 + s * 0.9 * crowded(p, 2.2, 9.8, 5)),
    # Crystals of an additive turn over and over between two heats
    Effect("crystals_turn_over_between_two_heats", "torque", "friction_coefficient", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 + s * winds(h, 2300, 1600, 3)),
    # The grooves are filled by a pump that pauses, and run dry meanwhile
    Effect("grooves_are_filled_by_a_pump_that_pauses", "torque", "friction_lag", "time", "difference", "s", 0.018,
           lambda s, t: s * (0.2 + 1.4 * fins(t - 0.05, 0.3, 0.4, 2.5))),
    # The other of two tanks is tried around noon, and serves from then on; viscosities differ by a power
    Effect("other_tank_is_tried_around_noon", "torque", "film_coefficient", "sequence", "ratio", "1", 3.0,
           lambda s, r: (1 + s) ** (0.49 * winds(r, 0.5, 0.2, 2.5))),
    # Shafts, converter and load
    # Three keys of the coupling have their play at the same twists, and bear each other in between
    Effect("three_keys_have_their_play_at_the_same_twists", "torque", "shaft_compliance", "twist", "difference",
           "rad/(N m)", 1.2e-4, lambda s, x: s * (0.3 + 1.2 * slits(x - 0.026, 0.034, 3))),
    # The charge oil is short until the clutch is filled, and a leak takes it at a higher pressure
    Effect("charge_oil_is_short_before_and_after_the_fill", "input speed", "converter_lag", "pressure", "difference",
           "s", 0.05, lambda s, p: s * (0.2 + 0.9 * bond(p, 4.2, 4))),
    # The chain of the load is drawn tight, lets go, and is drawn tight again as the speed rises
    Effect("load_chain_is_drawn_tight_and_lets_go", "output speed", "load_torque", "output_speed", "difference", "N m",
           30.0, lambda s, w: s * (1.6 * fins(w + 1, 15, 0.45, 2.5) - 0.5)),
)
SIXTEENTH = (*SIXTEENTH_PHYSICAL, *SIXTEENTH_SENSORS, *SIXTEENTH_UNLISTED)
NEAR = {"side_branch_of_the_line_rings_beside_its_speed": (97, 101, 104, 108)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a formula of the catalogue, or just 10 %."""
LATE = ("output_speed", "output_position")
"""What has hardly any size on `drawn97`, whose output moves just before lock-up: there is no effect over it there."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(97, 109)
                              if number not in NEAR.get(effect.name, ())
                              and not (number == 97 and effect.abscissa in LATE))
           for effect in SIXTEENTH}
"""The benches on which a case may have each effect."""
