"""Effects that no other list has: `TWENTYSECOND`, for the list `solar` of cases.py, on benches from `drawn169` on.

Units and scales are those of catalogue.py. The forms follow from mechanisms of valves, seals, linings and couplings.
None of them is a wave: they go over a dead centre, strike after some play, leap between two falls, break off after a
root, have two unlike humps, open and turn over, ride on a ramp and fall off, pass on a pulse, have a narrow peak in a
broad valley, or are drawn ever more and let go.
"""

import numpy as np

from .effect import Effect
from .twelfth_shapes import ramp
from .twentysecond_sensors import TWENTYSECOND_SENSORS
from .twentysecond_shapes import (
    duckbill,
    jets,
    nested,
    posistor,
    released,
    ridden,
    rounded,
    struck,
    toggled,
    twin,
)
from .twentysecond_unlisted import TWENTYSECOND_UNLISTED

_LIPS, _STRIKE = rounded(duckbill, 0.02), rounded(struck, 0.02)
TWENTYSECOND_PHYSICAL = (
    # Line pressure and valve
    # Two jets help the suction of the pump ever less as it turns faster, and break off in their throats
    Effect("suction_jets_break_off_at_two_speeds", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 + s * 1.2 * jets(w, 92, 205)),
    # The lips of a damper are opened by the armature's way out, and turn over; on its way back it strikes at last
    Effect("armature_opens_lips_and_strikes_on_its_way_back", "pressure", "valve_current", "current_excess",
           "difference", "A", 0.02, lambda s, i: -s * (1 - np.exp(-((i / 0.03) ** 4))) * np.where(
               i > 0, 1.1 * _LIPS(np.clip((i + 0.12) / 0.58, 0, 1)), -_STRIKE(np.clip(-i / 0.4, 0, 1)))),
    # A washer climbs the collar of the spool, rides up its cone, and falls off behind it
    Effect("washer_rides_on_the_cone_of_the_spool", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * 1.1 * ridden(u, 0.28, 0.78)),
    # Piston
    # The oil ring is drawn along ever more, until it runs off over a rim of the drum, and then up to the next one
    Effect("oil_ring_is_drawn_along_over_a_rim", "torque", "chamber_pressure", "input_speed", "difference", "bar",
           0.6, lambda s, w: s * (1.2 * released(w, 22, 168) - 0.2)),
    # The heater of the tank is switched on, warms ever more, is switched off in the cold, and the tank recovers
    Effect("tank_heater_warms_and_leaves_the_tank_cold", "torque", "oil_temperature_gain", "sequence", "ratio", "1",
           0.12, lambda s, r: 1 + s * (1.2 * ridden(r, 0, 1) - 0.3)),
    # A plate is dished by and by, turns over to the other side, and comes to lie on its neighbour
    Effect("plate_is_dished_by_and_by_and_turns_over", "torque", "clearance", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * toggled(r, 0, 1)),
    # Air in the feed is pressed together, a dead space opens with more of it, which is pressed together too
    Effect("dead_space_of_the_feed_opens_at_a_pressure", "torque", "piston_feed", "pressure", "difference", "m/bar",
           8e-5, lambda s, p: -s * (1.4 * posistor(p, 0.4, 9.5) - 0.2)),
    # The pins of the pack have play, strike at a pressure, and are bent
    Effect("pins_of_the_pack_strike_at_a_pressure", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * (1.4 * struck(p, 0.3, 10) - 0.2)),
    # A flap in the feed is carried by the flow over its dead centre; a power of resistances
    Effect("flap_of_the_feed_goes_over_its_dead_centre", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.4,
           lambda s, v: (1 + s) ** (1.1 * toggled(v, 0.0008, 0.0145))),
    # The guide ring is wedged by a taper of the bore up to a step, springs open behind it, and is wedged again
    Effect("guide_ring_is_wedged_by_two_tapers", "torque", "net_pressure", "piston", "difference", "bar", 1.4,
           lambda s, x: -s * (1.2 * released(x, 0.0001, 0.0021) - 0.2)),
    # A second lip of the seal is opened by the pressure on the way out, and turns over; on the way back it is closed
    Effect("second_lip_of_the_seal_opens_and_turns_over", "torque", "net_pressure", "driving_pressure", "difference",
           "bar", 1.0, lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(
               p > 0, 0.1 + 1.3 * duckbill(p, 0.1, 8), 0.4 * ramp(-p, 0, 0.8)))),
    # Plates
    # The film in the grooves sucks the plates together as a root of the slip, and breaks off in two kinds of grooves
    Effect("suction_of_two_kinds_of_grooves_breaks_off", "torque", "friction_coefficient", "slip", "ratio", "1", 0.12,
           lambda s, v: 1 + s * (1.3 * jets(v, 2, 42) - 0.3)),
    # Hard grains of the lining grip in a narrow range of pressures, and its soft fibres in a broad one
    Effect("grains_grip_at_one_pressure_and_fibres_at_another", "torque", "friction_coefficient", "contact_pressure",
           "ratio", "1", 0.12, lambda s, p: 1 + s * (1.3 * twin(p, 2.0, 9.2) - 0.3)),
    # The oil is thinned by the heat over a broad range, in which the resin has a transition of its own
    Effect("resin_has_a_transition_while_the_oil_is_thin", "torque", "friction_coefficient", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 + s * (1.3 * nested(h, 1900, 1400, 1500, 260) + 0.2)),
    # The grooves drain ever better over the slip, up to one at which their film begins to whirl
    Effect("film_in_the_grooves_whirls_from_a_slip", "torque", "friction_lag", "slip", "difference", "s", 0.022,
           lambda s, v: s * (0.2 + 1.3 * posistor(v, 1, 42))),
    # Thick oil is put in, a leak of gear oil thickens it further, and thin oil is put in, which takes up the rest
    Effect("thick_oil_and_a_leak_are_followed_by_thin_oil", "torque", "film_coefficient", "sequence", "ratio", "1", 8.0,
           lambda s, r: (1 + s) ** (0.6 * (ridden(r, 0, 1) - 0.35))),
    # Shafts, converter and load
    # The pads of the coupling climb a rib, give way ever more on its ramp, and fall behind it
    Effect("coupling_pads_climb_a_rib_and_fall_behind_it", "torque", "shaft_compliance", "twist", "difference",
           "rad/(N m)", 1.2e-4, lambda s, x: s * (0.45 + 1.1 * ridden(x, 0, 0.022))),
    # The clutch takes the charge oil of the converter by two bores of the valve, one of which is passed quickly
    Effect("two_bores_of_the_valve_take_the_charge_oil", "input speed", "converter_lag", "pressure", "difference", "s",
           0.05, lambda s, p: s * (0.35 + twin(p, 0.3, 10.5))),
    # The fluid of the load's coupling becomes thin, is heated until it presses the plates together, and is thin again
    Effect("load_coupling_presses_its_plates_together", "output speed", "load_torque", "output_speed", "difference",
           "N m", 30.0, lambda s, w: s * (1.5 * posistor(w, 0.5, 34) - 0.4)),
)
TWENTYSECOND = (*TWENTYSECOND_PHYSICAL, *TWENTYSECOND_SENSORS, *TWENTYSECOND_UNLISTED)
NEAR = {"suction_jets_break_off_at_two_speeds": (171, 172, 175, 177, 178, 179),
        "lubrication_lips_open_and_turn_over_by_the_pump": (171, 172, 177, 178),
        "drain_flap_turns_over_by_the_pump": (171, 172, 177, 178),
        "armature_opens_lips_and_strikes_on_its_way_back": (171, 172),
        "washer_rides_on_the_cone_of_the_spool": (175, 176),
        "grains_grip_at_one_pressure_and_fibres_at_another": (169, 176, 178, 180),
        "resin_has_a_transition_while_the_oil_is_thin": (169,),
        "thick_oil_and_a_leak_are_followed_by_thin_oil": (172, 174, 175),
        "guide_ring_is_wedged_by_two_tapers": (170, 174, 175, 177, 179),
        "pressure_line_bleeds_through_a_leak": (178,),
        "input_speed_supply_passes_on_a_ventilator": (180,)}
"""Numbers of the drawn benches on which a form is less than 12 % away from a textbook form, or hardly acts."""
STILL = ("contact_time", "output_speed", "output_position")
"""What has hardly any size on `drawn169` and `drawn180`, whose plates touch just before they lock."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(169, 181)
                              if number not in NEAR.get(effect.name, ())
                              and not (number in (169, 180) and effect.abscissa in STILL))
           for effect in TWENTYSECOND}
"""The benches on which a case may have each effect."""
