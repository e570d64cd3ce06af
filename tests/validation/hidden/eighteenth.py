"""Effects that no other list has: `EIGHTEENTH`, for the list `boreal` of cases.py, on benches from `drawn121` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: waves that
are captured, locks that slip, wear at both ends of a swing, modes that are excited by their own stiffness, dry
friction, rain that dries up, teeth of which one is missing, steel that yields, ladders, hunting that sets in, boils
that are overdue, pulses that become wider, chopped waves, and codes.
"""

import numpy as np

from .effect import Effect
from .eighteenth_sensors import EIGHTEENTH_SENSORS
from .eighteenth_shapes import (
    captured,
    hunting,
    missing,
    overdue,
    passband,
    puddles,
    rubbed,
    tongues,
    unlocked,
    widening,
    worn,
    yields,
)
from .eighteenth_unlisted import EIGHTEENTH_UNLISTED
from .twelfth_shapes import ramp

EIGHTEENTH_PHYSICAL = (
    # Line pressure and valve
    # The pulses of the pump are captured by those of its pipe between two speeds, first ahead of them, then behind
    Effect("pump_pulses_are_captured_by_the_pipe", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 + s * captured(w, 118, 177, 3)),
    # The dither locks the armature at slow changes, and lets it slip at faster ones, up sooner than down
    Effect("dither_lets_the_armature_slip_at_fast_changes", "pressure", "valve_current", "current_excess", "difference",
           "A", 0.02, lambda s, i: -s * np.where(i > 0, 1.2 * unlocked(i, 0, 0.06), 0.7 * unlocked(i, 0, 0.03))),
    # The spool was worn by its dither, most where that turns round
    Effect("spool_is_worn_where_its_dither_turns_round", "pressure", "valve_current", "current", "difference", "A",
           0.02, lambda s, u: s * (1.5 * worn(u, 0.38, 0.64) - 0.4)),
    # Piston
    # The oil ring swings by the play of its drum, at the speed of two swings per turn, of one, and of less
    Effect("oil_ring_swings_by_the_play_of_its_drum", "torque", "chamber_pressure", "input_speed", "difference", "bar",
           0.6, lambda s, w: s * (1.5 * tongues(w, 136, 24) - 0.4)),
    # The float of the mixing tap swings to its new place, and sticks there by friction
    Effect("float_of_the_mixing_tap_swings_and_sticks", "torque", "oil_temperature_gain", "sequence", "ratio", "1",
           0.12, lambda s, r: 1 + s * (rubbed(r, 0.16, 0.36, 0.11) - 0.6)),
    # Chips come between the plates in some runs, and are ground down evenly
    Effect("chips_come_between_the_plates_and_are_ground_down", "torque", "clearance", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 - s * (1.2 * puddles(r, 4.2, (0.13, 1.0), (0.47, 0.7), (0.58, 0.8)) - 0.4)),
    # The folds of a bellows open at pressures that are evenly spaced, but for one that is stuck
    Effect("bellows_has_a_fold_that_is_stuck", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * 1.4 * missing(p + 0.9, 2.6, 3)),
    # The shim behind the plates yields at a pressure, and hardens at a higher one
    Effect("shim_behind_the_plates_yields_and_hardens", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * (1.5 * yields(p, 4, 7.5, 2.5) - 0.6)),
    # The feed is a ladder of chambers and bores, which passes some flows better, and chokes a large one
    Effect("feed_is_a_ladder_of_chambers_and_bores", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.4,
           lambda s, v: (1 + s) ** (1.6 * passband(v, 0.0125, 4) - 1.1)),
    # The tool left marks in the bore, evenly but for one
    Effect("tool_marks_of_the_bore_are_even_but_for_one", "torque", "net_pressure", "piston", "difference", "bar", 1.2,
           lambda s, x: -s * 1.3 * missing(x + 0.0001, 0.00062, 3)),
    # The lip begins to hunt at a pressure on the way out, ever more; on the way back it is drawn on
    Effect("seal_lip_begins_to_hunt_at_a_pressure", "torque", "net_pressure", "driving_pressure", "difference", "bar",
           0.6, lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(
               p > 0, 0.75 + 0.6 * hunting(p, 1.6, 3.2, 7), 0.4 * ramp(-p, 0, 0.8)))),
    # Plates
    # The plates are locked to the chatter of their carrier about a slip, and slip through it beside
    Effect("plates_lock_to_the_chatter_of_their_carrier", "torque", "friction_coefficient", "slip", "ratio", "1", 0.08,
           lambda s, v: 1 + s * (1.5 * np.abs(unlocked(v, 17, 5)) - 0.8)),
    # The tone of the plates is captured by that of the housing between two pressures
    Effect("tone_of_the_plates_is_captured_by_the_housing", "torque", "friction_coefficient", "contact_pressure",
           "ratio", "1", 0.12, lambda s, p: 1 + s * 1.1 * captured(p, 4.2, 8.6, 0.25)),
    # Moisture in the linings boils late and at once, stays until it is gone, and lets the heat rise again
    Effect("moisture_of_the_linings_boils_late", "torque", "friction_coefficient", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 - s * (0.9 * np.minimum(overdue(np.maximum(h, 0), 800, 1700, 3000), 2.4) - 1)),
    # The pilot of the lubrication begins to hunt at a current of the valve
    Effect("lubrication_pilot_hunts_above_a_current", "torque", "friction_lag", "current", "difference", "s", 0.022,
           lambda s, u: s * (0.8 + 0.55 * hunting(u, 0.36, 0.17, 0.65))),
    # Gear oil leaks in and is drawn off by turns, for ever longer; viscosities differ by a power
    Effect("gear_oil_leaks_in_for_ever_longer", "torque", "film_coefficient", "sequence", "ratio", "1", 3.0,
           lambda s, r: (1 + s) ** (0.8 * widening(r, 0.05, 1.0, 3) - 0.4)),
    # Shafts, converter and load
    # The friction ring of the damper is locked up to a twist, and slips beyond
    Effect("damper_ring_is_locked_up_to_a_twist", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)",
           1.2e-4, lambda s, x: s * (0.2 + 1.2 * unlocked(np.maximum(x, 0), 0, 0.022))),
    # The outlet of the converter passes the holes of a ring on the output, one of which was not drilled
    Effect("outlet_ring_of_the_converter_lacks_a_hole", "input speed", "converter_lag", "output_position", "difference",
           "s", 0.05, lambda s, x: s * (0.2 + 1.3 * missing(x, 2.3, 3))),
    # The belt of the load swings by the play of its pulley, at the speed of two swings per turn, of one, and of less
    Effect("load_belt_swings_by_the_play_of_its_pulley", "output speed", "load_torque", "output_speed", "difference",
           "N m", 30.0, lambda s, w: s * (1.5 * tongues(w, 24, 5) - 0.4)),
)
EIGHTEENTH = (*EIGHTEENTH_PHYSICAL, *EIGHTEENTH_SENSORS, *EIGHTEENTH_UNLISTED)
NEAR = {"pump_pulses_are_captured_by_the_pipe": (123, 125, 129, 131)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a formula of the catalogue, or constant."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(121, 133)
                              if number not in NEAR.get(effect.name, ())) for effect in EIGHTEENTH}
"""The benches on which a case may have each effect."""
