"""Effects that no other list has: `TWELFTH`, for the list `remote` of cases.py, on benches from `drawn49` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: straight
lines between two stops, roofs, valleys with a flat floor, sudden onsets that fade, dips beside bumps, and parts that
are exchanged. No earlier list has the form for the same pair.
"""

import numpy as np

from .effect import Effect
from .tenth_shapes import shelf
from .twelfth_sensors import TWELFTH_SENSORS
from .twelfth_shapes import eased, onset, ramp, roof, since, swing, trough
from .twelfth_unlisted import TWELFTH_UNLISTED

TWELFTH_PHYSICAL = (
    # Line pressure and valve
    # The pump gives more with speed, until its stroke control takes over, and takes back too much
    Effect("stroke_control_takes_back_too_much", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 + s * (1.1 * ramp(w, 105, 162) - 1.6 * ramp(w, 166, 178) - 0.2)),
    # A plunger between armature and spool has a free path, and then a cushioned stop: farther on the way up than down
    Effect("plunger_moves_between_two_stops", "pressure", "valve_current", "current_excess", "difference", "A", 0.02,
           lambda s, i: s * (0.7 * eased(-i, 0.025, 0.055) - 1.1 * eased(i, 0.01, 0.07))),
    # Two transistors share the current; where one hands over to the other, it is first too small, then too large
    Effect("driver_hands_over_between_two_transistors", "pressure", "valve_current", "current", "difference", "A",
           0.02, lambda s, u: s * swing(u, 0.5, 0.09)),
    # Piston
    # From a speed on the balancing chamber behind the piston is full, and takes most of the head away
    Effect("balancing_chamber_fills_at_a_speed", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.6,
           lambda s, w: s * (w / 110) ** 2 * (1 - 0.85 * ramp(w, 108, 124))),
    # The fill becomes the slower the more the filter is clogged, until the next one is put in
    Effect("feed_filter_clogs_and_is_changed_twice", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.16,
           lambda s, r: 1 - s * (1.6 * (since(np.maximum(r, 0), (0.27, 0.74)) / 0.47) ** 1.5 - 0.4)),
    # A glaze protects the linings; once it is through they wear, until some plates are exchanged
    Effect("glaze_wears_through_before_plates_are_exchanged", "torque", "clearance", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * (1.4 * ramp(r, 0.28, 0.66) - np.where(r > 0.79, 1.1, 0.0) - 0.2)),
    # A gas accumulator takes no oil below its preload, and the less the more its gas is compressed
    Effect("gas_accumulator_takes_oil_above_its_preload", "torque", "piston_feed", "pressure", "difference", "m/bar",
           6e-5, lambda s, p: -s * 1.2 * onset(p, 3.2, 0.6, 1.6)),
    # A waved plate is pressed flat at a low pressure; at a high one the housing opens
    Effect("waved_plate_is_flat_before_the_housing_opens", "torque", "clearance", "pressure", "ratio", "1", 0.14,
           lambda s, p: 1 + s * (trough(np.clip(p, 0, 16), 4, 8.5, 5) - 0.4)),
    # The ball of a check valve hangs half open at flows between that which lifts it and that which holds it
    Effect("check_ball_hangs_between_two_flows", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.35,
           lambda s, v: 1 - s * shelf(v, 0.0045, 0.0115, 0.003)),
    # A return spring buckles, loses a part of its force, and is pressed on from there
    Effect("return_spring_buckles_at_a_stroke", "torque", "net_pressure", "piston", "difference", "bar", 2.1,
           lambda s, x: -s * (np.clip(x, 0, 0.0028) / 0.0011 - 1.5 * ramp(x, 0.0010, 0.00125))),
    # The lip is dry at a low pressure, rides on oil at a middle one, and is pressed through it at a high one
    Effect("seal_lip_rides_on_oil_in_between", "torque", "net_pressure", "driving_pressure", "difference", "bar", 0.9,
           lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(
               p > 0, 0.15 + trough(np.clip(p, 0, 12), 3, 5.5, 2.8), 0.4 * ramp(-p, 0, 1)))),
    # Plates
    # The plates have two modes of vibration, at each of which they hop and carry less
    Effect("plates_hop_at_two_slips", "torque", "friction_coefficient", "slip", "ratio", "1", 0.12,
           lambda s, v: 1 - s * (1.2 / (1 + ((v - 9) / 3) ** 2) + 1 / (1 + ((v - 29) / 5) ** 2) - 0.4)),
    # Coned plates carry by their inner rim, tilt over at a pressure, and carry by the outer rim with its longer lever
    Effect("coned_plates_tilt_over_at_a_pressure", "torque", "friction_coefficient", "contact_pressure", "ratio", "1",
           0.12, lambda s, p: 1 + s * swing(p, 6, 1.3)),
    # An additive builds a film at a heat, which is then rubbed off by and by
    Effect("additive_reacts_at_a_heat_and_is_rubbed_off", "torque", "friction_coefficient", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 + s * (1.7 * onset(h, 1000, 350, 0.9) - 0.7)),
    # The grooves are filled in a band of speeds: below it little oil is thrown there, above it the oil is thrown out
    Effect("grooves_are_filled_in_a_band_of_speeds", "torque", "friction_lag", "input_speed", "difference", "s", 0.025,
           lambda s, w: s * (0.15 + 1.5 * roof(w, 65, 115, 160))),
    # Cooling water leaks into the oil in a few runs, and boils off in the following ones
    Effect("water_leaks_in_and_boils_off", "torque", "film_coefficient", "sequence", "ratio", "1", 1.2,
           lambda s, r: 1 + s * 1.2 * roof(r, 0.22, 0.3, 0.84)),
    # Shafts, converter and load
    # The springs of the damper are preloaded, and meet each other by and by once they yield
    Effect("damper_springs_are_preloaded", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 1e-4,
           lambda s, x: s * (0.45 + 1.2 * onset(x, 0.024, 0.02, 1.4))),
    # The charge pressure breaks down as the plates bite, and the controller of the pump brings it back
    Effect("charge_pressure_breaks_down_as_the_plates_bite", "input speed", "converter_lag", "contact_time",
           "difference", "s", 0.05, lambda s, t: s * (0.15 + 1.4 * roof(t, 0.02, 0.14, 0.5))),
    # The machine of the load regulates to a speed: it drives below it, brakes above it, and gives up far from it
    Effect("load_machine_regulates_to_a_speed", "output speed", "load_torque", "output_speed", "difference", "N m",
           40.0, lambda s, w: s * swing(w, 13, 6)),
)
TWELFTH = (*TWELFTH_PHYSICAL, *TWELFTH_SENSORS, *TWELFTH_UNLISTED)
NEAR = {"stroke_control_takes_back_too_much": (50, 54, 56)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a formula of the catalogue, or just 10 %."""
JUMPING = {"damper_springs_are_preloaded": (58,), "charge_pressure_breaks_down_as_the_plates_bite": (58,),
           "chamber_leaks_through_a_crack_when_warm": (58,)}
"""Numbers of the drawn benches on which an engagement locks much later or earlier with a form than without it.

It is the only thing by which the form is visible there at its limit, which is therefore far too low.
"""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(49, 61)
                              if number not in NEAR.get(effect.name, ()) + JUMPING.get(effect.name, ()))
           for effect in TWELFTH}
"""The benches on which a case may have each effect."""
