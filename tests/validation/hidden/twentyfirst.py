"""Effects that no other list has: `TWENTYFIRST`, for the list `lunar` of cases.py, on benches from `drawn157` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation. None of them
is a wave: they have regimes of different slopes, stop at an end after ever more, are given in doses, saturate but at
one place, flip between two positions, pass a shock, are pulled until they break, change their order, set in and are
partly undone, jump between branches, seize, relax after steps, or are destroyed and come back.
"""

import numpy as np

from .effect import Effect
from .twelfth_shapes import ramp
from .twentyfirst_sensors import TWENTYFIRST_SENSORS
from .twentyfirst_shapes import (
    absorbed,
    branches,
    doses,
    flips,
    pulled,
    regimes,
    relaxing,
    shock,
    stopping,
)
from .twentyfirst_unlisted import TWENTYFIRST_UNLISTED

TWENTYFIRST_PHYSICAL = (
    # Line pressure and valve
    # A valve between two suction pipes is thrown over by the flow at three speeds
    Effect("suction_valve_is_thrown_over_at_three_speeds", "pressure", "pressure_gain", "motor_speed", "ratio", "1",
           0.06, lambda s, w: 1 + s * 0.9 * flips(w, (138, 4), (165, 4), (188, 4))),
    # The film of the armature yields on its way out, hardens and breaks; on its way back it is torn off at a change
    Effect("armature_is_torn_off_and_its_film_breaks", "pressure", "valve_current", "current_excess", "difference", "A",
           0.02, lambda s, i: -s * (1 - np.exp(-((i / 0.01) ** 2))) * np.where(
               i > 0, 1.1 * pulled(np.abs(i), 0.32), -0.9 * shock(np.abs(i), 0.04, 0.004, 0.03))),
    # The spool is shifted by each of four edges of its sleeve, and the jet behind it makes up for most of it
    Effect("jet_makes_up_for_edges_of_the_sleeve", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * 1.1 * relaxing(u, 0.008, 0.06, 0.2, (0.3, 1.0), (0.47, -1.3), (0.585, 1.3), (0.68, -1.2))),
    # Piston
    # The oil ring is full above a speed, except at one at which the drum shakes it out
    Effect("oil_ring_is_full_but_is_shaken_out_at_a_speed", "torque", "chamber_pressure", "input_speed", "difference",
           "bar", 0.6, lambda s, w: s * (1.5 * absorbed(w - 25, 28, 88, 12) - 0.4)),
    # An agent against foam is put in three times, works late, and is used up
    Effect("agent_against_foam_is_put_in_and_used_up", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * (1.4 * doses(r, 0.025, 0.1, (0.05, 0.7), (0.36, 1.1), (0.61, 0.8)) - 0.6)),
    # Shims are put in, taken out and put in again, and the pack settles most of the way each time
    Effect("shims_are_changed_and_the_pack_settles", "torque", "clearance", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * (1.1 * relaxing(r, 0.008, 0.09, 0.3, (0.16, 1.0), (0.43, -1.2), (0.7, 1.3)) - 0.2)),
    # The bellows of the feed's store yields by the pressure, hardens, and is torn
    Effect("bellows_of_the_store_yields_and_is_torn", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * (1.4 * pulled(p, 9) - 0.2)),
    # The dished plate at the end of the pack is turned over by the pressure, back by its housing, and over again
    Effect("dished_plate_of_the_pack_is_turned_over_and_back", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * (0.8 * flips(p, (2.1, 0.25), (4.4, 0.3), (8.1, 0.4)) + 0.3)),
    # The ball of the feed is drawn back ever more by the flow, until it is blown off its seat; a power of resistances
    Effect("ball_of_the_feed_is_blown_off_its_seat", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.4,
           lambda s, v: (1 + s) ** (1.2 * shock(v, 0.0075, 0.00025, 0.004) - 0.3)),
    # A guide ring is taken along by the piston up to its grip, except where it passes a relief of the bore
    Effect("guide_ring_is_taken_along_but_in_a_relief", "torque", "net_pressure", "piston", "difference", "bar", 0.8,
           lambda s, x: -s * (1.3 * absorbed(x - 0.0002, 0.0004, 0.0014, 0.00014) - 0.3)),
    # The lip of the seal is drawn into its gap ever more on the way out, until it snaps out; on the way back it is free
    Effect("seal_lip_is_drawn_into_its_gap_and_snaps_out", "torque", "net_pressure", "driving_pressure", "difference",
           "bar", 1.2, lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(
               p > 0, 1.3 * stopping(np.maximum(p, 0), 7, 0.2), 0.4 * ramp(-p, 0, 0.8)))),
    # Plates
    # The plates swing in the flow of the oil over the slip, on one branch after another
    Effect("plates_swing_in_the_oil_on_three_branches", "torque", "friction_coefficient", "slip", "ratio", "1", 0.12,
           lambda s, v: 1 - s * (1.5 * branches(v, 4, 38) - 0.7)),
    # The lining is carried by its fibres, its pores, its resin and its steel, which have their slope each
    Effect("fibres_pores_resin_and_steel_carry_in_turn", "torque", "friction_coefficient", "contact_pressure", "ratio",
           "1", 0.12, lambda s, p: 1 + s * (regimes(p, 0.08, (3.4, 1.6), (4.4, -1.9), (5.4, 0), (6.6, 2.0), (7.5, -0.9),
                                                    (8.6, 0)) - 0.7)),
    # Two films drive each other off the plates, at each of three heats
    Effect("two_films_drive_each_other_off_the_plates", "torque", "friction_coefficient", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 + s * (0.8 * flips(h, (480, 60), (1450, 120), (3100, 250)) + 0.2)),
    # The grooves are emptied by the input up to a speed, at which a wall of oil stands in them
    Effect("wall_of_oil_stands_in_the_grooves_from_a_speed", "torque", "friction_lag", "input_speed", "difference", "s",
           0.022, lambda s, w: s * (0.5 + 1.1 * shock(w, 98, 3, 35))),
    # The pump of an additive runs, leaks, stands and is drained, and runs again; viscosities differ by a power
    Effect("additive_pump_runs_leaks_stands_and_is_drained", "torque", "film_coefficient", "sequence", "ratio", "1",
           4.0, lambda s, r: (1 + s) ** regimes(r, 0.01, (0.08, 2.8), (0.27, -1.0), (0.5, 0), (0.6, -5.6), (0.69, 2.2),
                                                (0.93, 0))),
    # Shafts, converter and load
    # The rubber of the coupling gives way ever more, until it lies on its stop
    Effect("coupling_rubber_gives_way_up_to_its_stop", "torque", "shaft_compliance", "twist", "difference",
           "rad/(N m)", 1.2e-4, lambda s, x: s * (0.2 + 1.4 * stopping(x, 0.018, 0.0007))),
    # The stator swings in the flow over the speed of the input, on one branch after another
    Effect("stator_swings_in_the_flow_on_three_branches", "input speed", "converter_lag", "input_speed", "difference",
           "s", 0.05, lambda s, w: s * (0.2 + 1.4 * branches(w, 45, 150))),
    # The drive of the load shifts at three speeds, and its controller makes up for most of it
    Effect("load_drive_makes_up_for_three_shifts", "output speed", "load_torque", "output_speed", "difference", "N m",
           30.0, lambda s, w: s * (1.2 * relaxing(w, 0.4, 8, 0.3, (5, 1.0), (13, -1.4), (26, 1.4)) - 0.3)),
)
TWENTYFIRST = (*TWENTYFIRST_PHYSICAL, *TWENTYFIRST_SENSORS, *TWENTYFIRST_UNLISTED)
NEAR = {"suction_valve_is_thrown_over_at_three_speeds": (158, 163, 164, 166, 167),
        "armature_is_torn_off_and_its_film_breaks": (160, 168),
        "jet_makes_up_for_edges_of_the_sleeve": (158, 159),
        "oil_ring_is_full_but_is_shaken_out_at_a_speed": (159,),
        "load_drive_makes_up_for_three_shifts": (159, 165),
        "input_speed_supply_makes_up_for_three_loads": (157, 158, 163),
        "output_speed_trigger_skips_the_surplus": (159, 160, 162, 165)}
"""Numbers of the drawn benches on which a form is less than 12 % away from a textbook form."""
STILL = ("contact_time", "output_speed", "output_position")
"""What has hardly any size on `drawn158`, whose plates touch just before they lock, and whose output hardly moves."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(157, 169)
                              if number not in NEAR.get(effect.name, ())
                              and not (number == 158 and effect.abscissa in STILL))
           for effect in TWENTYFIRST}
"""The benches on which a case may have each effect."""
