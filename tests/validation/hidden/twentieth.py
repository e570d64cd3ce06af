"""Effects that no other list has: `TWENTIETH`, for the list `glacial` of cases.py, on benches from `drawn145` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: waves before
a turning point, vanes that stall, lobes behind a slit, rings on a drum, waves that lose every other crest, what grows
again after it was cut, beats of a valve, stores that drain between crests, two tones by turns, waves in a bowl, steps
of three sizes, shingles, crystals that untwist, jams, and waves that are revived.
"""

import numpy as np

from .effect import Effect
from .twelfth_shapes import ramp
from .twentieth_sensors import TWENTIETH_SENSORS
from .twentieth_shapes import (
    doubling,
    drum,
    jam,
    lobes,
    rainbow,
    regrown,
    revived,
    shingles,
    slam,
    smoothed,
    stalled,
    trapped,
    twisted,
    warble,
)
from .twentieth_unlisted import TWENTIETH_UNLISTED

TWENTIETH_PHYSICAL = (
    # Line pressure and valve
    # The mouth of the suction pipe sends waves ahead, which add up at one speed and cancel at others
    Effect("suction_mouth_sends_waves_that_add_up_at_a_speed", "pressure", "pressure_gain", "motor_speed", "ratio", "1",
           0.06, lambda s, w: 1 + s * (1.4 * lobes(w, 148, 17) - 0.4)),
    # The plate of the armature swings like a drum as the current changes
    Effect("armature_plate_swings_like_a_drum", "pressure", "valve_current", "current_excess", "difference", "A", 0.02,
           lambda s, i: -s * 1.1 * drum(i, 0.07)),
    # Two grinding wheels left nearly the same waves on the spool, which die out and come back along it
    Effect("waves_on_the_spool_die_out_and_come_back", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * revived(u - 0.33, 0.15, 0.45)),
    # Piston
    # Waves of the drum fill the oil ring at speeds that are evenly spaced, between which it drains
    Effect("oil_ring_is_filled_by_waves_and_drains", "torque", "chamber_pressure", "input_speed", "difference", "bar",
           0.6, lambda s, w: s * (1.7 * smoothed(w - 34, 46, 25) - 1.0)),
    # Algae in the cooler grow again after each of three cleanings, which are not equally thorough
    Effect("algae_in_the_cooler_grow_again", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * (1.4 * regrown(r, 22, (0, 0.3), (0.17, 0.03), (0.52, 0.3), (0.72, 0.02)) - 0.7)),
    # The pack swells up to a run and shrinks after it, and settles by a bit as it does
    Effect("pack_swells_and_shrinks_and_settles_by_bits", "torque", "clearance", "sequence", "ratio", "1", 0.07,
           lambda s, r: 1 + s * (1.6 * shingles(r, 0.04, 0.58, 1.01, 5) - 0.5)),
    # Folds of the feed's hose open by the pressure, of which every other one sticks as it becomes higher
    Effect("every_other_fold_of_the_hose_sticks", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * (0.5 + doubling(p - 2.5, 5.5, 3, 9))),
    # The cover slams on its seat at a pressure, is thrown back, and bends on beyond
    Effect("cover_slams_on_its_seat_at_a_pressure", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * (1.5 * slam(p, 5, 1.8) - 0.4)),
    # Waves stand before the throat of the feed up to a flow, and are washed away above; resistances differ by a power
    Effect("waves_before_the_throat_are_washed_away", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.4,
           lambda s, v: (1 + s) ** (0.9 * rainbow(v, 0.0115, 0.0019))),
    # The bore was honed by a tool that swung about its middle
    Effect("honing_tool_swung_about_the_middle_of_the_bore", "torque", "net_pressure", "piston", "difference", "bar",
           1.2, lambda s, x: s * 1.1 * trapped(x, 0.0013, 0.00045)),
    # The lip squeaks in two tones by turns on the way out, as the pressure rises; on the way back it is drawn on
    Effect("seal_lip_squeaks_in_two_tones", "torque", "net_pressure", "driving_pressure", "difference", "bar", 0.6,
           lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(
               p > 0, 0.75 + 0.55 * warble(p, 5.6), 0.4 * ramp(-p, 0, 0.8)))),
    # Plates
    # Vanes in the grooves lift the plates from each other until their flow stalls, and broadly again at a higher slip
    Effect("vanes_in_the_grooves_lift_the_plates_and_stall", "torque", "friction_coefficient", "slip", "ratio", "1",
           0.12, lambda s, v: 1 - s * (1.5 * stalled(v, 9, 46) - 0.7)),
    # Fibres of the linings untwist from a pressure on, and show their rough and their smooth side by turns
    Effect("fibres_of_the_linings_untwist_under_pressure", "torque", "friction_coefficient", "contact_pressure",
           "ratio", "1", 0.12, lambda s, p: 1 + s * (1.4 * twisted(p, 2.6, 10, 2) - 0.7)),
    # Dust comes off with the heat, jams in the grooves at once, and is burnt evenly
    Effect("dust_jams_in_the_grooves_and_is_burnt", "torque", "friction_coefficient", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 - s * (1.5 * jam(h, 1300, 0.4, 3600) - 0.5)),
    # The grooves answer to one slip most, and to others ever less
    Effect("grooves_answer_to_one_slip_most", "torque", "friction_lag", "slip", "difference", "s", 0.022,
           lambda s, v: s * (0.3 + 1.2 * lobes(v, 17, 6))),
    # Two tanks of oil are mixed in two rhythms by turns; viscosities differ by a power
    Effect("two_tanks_are_mixed_in_two_rhythms", "torque", "film_coefficient", "sequence", "ratio", "1", 3.0,
           lambda s, r: (1 + s) ** (0.49 * warble(r + 0.06, 0.7))),
    # Shafts, converter and load
    # The rubber of the coupling yields up to a twist, folds over, and yields again
    Effect("coupling_rubber_folds_over_at_a_twist", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)",
           1.2e-4, lambda s, x: s * (0.2 + 1.3 * stalled(x, 0.015, 0.075))),
    # The charge valve slams after the command, is thrown back, and opens again broadly
    Effect("charge_valve_slams_after_the_command", "input speed", "converter_lag", "time", "difference", "s", 0.05,
           lambda s, t: s * (0.6 + 1.0 * slam(t, 0.34, 0.13))),
    # Waves run ahead of the belt of the load up to a speed, above which they cannot follow
    Effect("waves_run_ahead_of_the_load_belt", "output speed", "load_torque", "output_speed", "difference", "N m", 30.0,
           lambda s, w: s * rainbow(w, 21, 3.3)),
)
TWENTIETH = (*TWENTIETH_PHYSICAL, *TWENTIETH_SENSORS, *TWENTIETH_UNLISTED)
NEAR = {"suction_mouth_sends_waves_that_add_up_at_a_speed": (145, 146, 155, 156),
        "torque_sleeve_follows_in_steps_of_three_sizes": (152,)}
"""Numbers of the drawn benches on which a form is less than or hardly more than 10 % away from a textbook form."""
LATE = ("heat", "contact_time", "output_speed", "output_position")
"""What has hardly any size on `drawn152`, where the plates touch just before they lock."""
STILL = ("output_speed", "output_position")
"""What has hardly any size on `drawn148` either, whose output moves little before lock-up."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(145, 157)
                              if number not in NEAR.get(effect.name, ())
                              and not (number == 152 and effect.abscissa in LATE)
                              and not (number == 148 and effect.abscissa in STILL))
           for effect in TWENTIETH}
"""The benches on which a case may have each effect."""
