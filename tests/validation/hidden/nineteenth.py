"""Effects that no other list has: `NINETEENTH`, for the list `alpine` of cases.py, on benches from `drawn133` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: resonances
that interfere with a direct path, loads from which uneven parts slide down, springs that become harder until the
vibration collapses, ripples behind an edge, swells with sharp crests, siphons, bores that pass ports, fringes that are
counted to and fro, humps with a hole, teeth in mesh, strings that are plucked, vapours that condense, paths with ever
wider turns, uneven roads, and rules whose marks meet.
"""

import numpy as np

from .effect import Effect
from .nineteenth_sensors import NINETEENTH_SENSORS
from .nineteenth_shapes import (
    avalanches,
    bores,
    condensing,
    fano,
    folded,
    holed,
    leaning,
    meshing,
    plucked,
    swell,
    switchbacks,
    tipping,
    uneven,
    vernier,
)
from .nineteenth_unlisted import NINETEENTH_UNLISTED
from .twelfth_shapes import ramp

NINETEENTH_PHYSICAL = (
    # Line pressure and valve
    # The pulses of the pump come by the line and by a blind pipe, which resonates: they cancel, and then add up
    Effect("pump_pulses_cancel_and_add_up_by_two_ways", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 + s * (1.5 * fano(w, 158, 16, 1.7) - 0.5)),
    # Slow and fast changes take the armature along by its bush, but not those to which the bush is tuned
    Effect("armature_bush_takes_along_all_changes_but_one", "pressure", "valve_current", "current_excess", "difference",
           "A", 0.02, lambda s, i: -s * (1.3 * holed(i, 0.16, 0.16, 0.04) - 0.9 * holed(i, -0.11, 0.11, 0.03))),
    # Bores of the spool pass four ports, of which the first is as wide as they are
    Effect("bores_of_the_spool_pass_four_ports", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * (1.4 * bores(u, (0.36, 0.05, 0.05), (0.51, 0.05, 0.03), (0.62, 0.04, 0.03),
                                         (0.72, 0.04, 0.02)) - 0.5)),
    # Piston
    # The oil ring swings in a drum that becomes stiffer, ever more with the speed, until its swing collapses
    Effect("oil_ring_swings_ever_more_and_collapses", "torque", "chamber_pressure", "input_speed", "difference", "bar",
           0.6, lambda s, w: s * (1.5 * leaning(w, 62, 66, 9, 2.5) - 0.4)),
    # The tank of the cooling water is emptied by a siphon whenever it is full, and filled ever faster by the next
    Effect("cooling_water_is_drawn_by_a_siphon", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * 0.9 * tipping(r - 0.13, 0.62, 0.05)),
    # Debris builds up between the plates, and slides out in uneven parts
    Effect("debris_between_the_plates_slides_out_unevenly", "torque", "clearance", "sequence", "ratio", "1", 0.055,
           lambda s, r: 1 - s * (1.4 * avalanches(r, 4, 0.02, (0.19, 0.5), (0.34, 0.35), (0.62, 1.35), (0.84, 0.7))
                                 - 0.7)),
    # Vapour in a pocket of the feed condenses as the pressure rises, against the oil that comes behind it
    Effect("vapour_in_the_feed_condenses", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * 1.3 * condensing(p, 1.2, 3.4)),
    # A ring behind the plates is struck at pressures that are evenly spaced, as its teeth let go, and swings
    Effect("ring_behind_the_plates_is_plucked", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * 1.1 * plucked(p - 0.9, 5.2, 2, 2.6)),
    # The flap of the feed passes most below and above the flow at which it flutters; resistances differ by a power
    Effect("flap_of_the_feed_flutters_within_its_range", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.4,
           lambda s, v: (1 + s) ** (1.6 * holed(v, 0.0085, 0.0085, 0.0016) - 0.6)),
    # Two tools left their marks in the bore, which meet at some places, and leave it wider in between
    Effect("marks_of_two_tools_meet_in_the_bore", "torque", "net_pressure", "piston", "difference", "bar", 1.2,
           lambda s, x: s * (0.6 - 1.4 * vernier(x - 0.0011, 0.00088, 0.00064))),
    # The lip swings to and fro over its grooves on the way out, as the pressure rises; on the way back it is drawn on
    Effect("seal_lip_swings_to_and_fro_over_its_grooves", "torque", "net_pressure", "driving_pressure", "difference",
           "bar", 0.6, lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(
               p > 0, 0.75 + 0.55 * folded(p, 13, 0.7), 0.4 * ramp(-p, 0, 0.8)))),
    # Plates
    # The plates swing on splines that become stiffer, ever more up to a slip, at which the swing collapses
    Effect("plates_swing_on_their_splines_and_collapse", "torque", "friction_coefficient", "slip", "ratio", "1", 0.08,
           lambda s, v: 1 - s * (1.5 * leaning(v, 7, 17, 2.6, 1.5) - 0.6)),
    # The lining holds its oil between two pressures, but for the one that opens its pores
    Effect("pores_of_the_lining_open_at_a_pressure", "torque", "friction_coefficient", "contact_pressure", "ratio", "1",
           0.12, lambda s, p: 1 - s * (1.5 * holed(p, 6.4, 4.2, 0.7) - 0.6)),
    # A coating of the plates grows and gives way at once, by turns
    Effect("coating_of_the_plates_gives_way_by_turns", "torque", "friction_coefficient", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 + s * 0.8 * tipping(h - 500, 3300, 0.12)),
    # The grooves are filled by a swell in the oil ring of the output
    Effect("swell_of_the_oil_ring_fills_the_grooves", "torque", "friction_lag", "output_speed", "difference", "s",
           0.022, lambda s, w: s * (0.9 + 0.75 * swell(w - 11, 17, 0.8))),
    # Three tanks are let into the oil by turns, each in a rhythm of its own; viscosities differ by a power
    Effect("three_tanks_are_let_in_by_turns", "torque", "film_coefficient", "sequence", "ratio", "1", 3.0,
           lambda s, r: (1 + s) ** (0.55 * uneven(r, 0.62))),
    # Shafts, converter and load
    # The teeth of the coupling carry by one pair and by two, by turns
    Effect("coupling_teeth_carry_by_one_pair_and_by_two", "torque", "shaft_compliance", "twist", "difference",
           "rad/(N m)", 1.2e-4, lambda s, x: s * (1.5 - 1.2 * meshing(x, 0.041, 0.45))),
    # The oil of the converter comes by the gap and by the hub, which resonates with the slip of the plates
    Effect("converter_oil_comes_by_the_gap_and_by_the_hub", "input speed", "converter_lag", "slip", "difference", "s",
           0.05, lambda s, v: s * (0.15 + 1.4 * fano(v, 17, 7, 1.1))),
    # The controller of the load's drive overshoots ever more as the speed rises
    Effect("load_drive_overshoots_ever_more", "output speed", "load_torque", "output_speed", "difference", "N m",
           30.0, lambda s, w: s * switchbacks(w, 1, 34, 1.4, 5)),
)
NINETEENTH = (*NINETEENTH_PHYSICAL, *NINETEENTH_SENSORS, *NINETEENTH_UNLISTED)
NEAR = {"pump_pulses_cancel_and_add_up_by_two_ways": (134, 135, 136, 138, 140),
        "output_counter_folds_the_pulses_of_the_inverter": (134, 135, 138, 140)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a textbook form, or constant."""
LATE = ("heat", "contact_time", "output_speed", "output_position")
"""What has hardly any size on `drawn135` and `drawn141`, where most engagements lock as soon as the plates touch."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(133, 145)
                              if number not in NEAR.get(effect.name, ())
                              and not (number in (135, 141) and effect.abscissa in LATE))
           for effect in NINETEENTH}
"""The benches on which a case may have each effect."""
