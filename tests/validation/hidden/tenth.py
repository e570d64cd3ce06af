"""Effects that no other list has: `TENTH`, for the list `afield` of cases.py, on the drawn benches from `drawn25` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: pointed
peaks, flat tops between two flanks, arches side by side, passages through a resonance, and rounded or sharp valleys.
No earlier list has the form for the same pair.
"""

import numpy as np

from .effect import Effect
from .fifth import passage
from .ninth_shapes import edge, hinge, hump
from .seventh_waves import skewed
from .tenth_sensors import TENTH_SENSORS
from .tenth_shapes import crest, scallops, shelf, warmed
from .tenth_unlisted import TENTH_UNLISTED

TENTH_PHYSICAL = (
    # Line pressure and valve
    # The bladder of the damper has lost its gas: the line is lifted at the one speed at which pulses add up
    Effect("pulsation_damper_has_lost_its_gas", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 + s * (1.5 * crest(w, 148, 14, 22) - 0.5)),
    # A loose pole screw: a small change of the current is held back, a large one throws the armature forward
    Effect("pole_screw_is_loose", "pressure", "valve_current", "current_excess", "difference", "A", 0.02,
           lambda s, i: -s * np.sign(i) * (hump(np.abs(i), 0.012, 1.6) - 0.9 * i**4 / (i**4 + 0.045**4))),
    # A driver with ranges: its error grows over a range and is set back at the next one
    Effect("valve_driver_changes_its_range", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * skewed((u - 0.1) / 0.23, 0.92)),
    # Piston
    # A vent draws air from the chamber, ever more with speed, until the oil ring closes it
    Effect("vent_draws_air_until_the_oil_ring_closes_it", "torque", "chamber_pressure", "input_speed", "difference",
           "bar", 0.5, lambda s, w: s * (1.3 * (np.abs(w - 108) / 55) ** 1.4 - 0.7)),
    Effect("tank_heater_is_on_for_a_while", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * (1.3 * warmed(r, 0.28, 0.6, 0.1, 0.18) - 0.3)),
    # Debris builds up between the plates until the pack is flushed
    Effect("plates_pick_up_debris_and_are_flushed", "torque", "clearance", "sequence", "ratio", "1", 0.15,
           lambda s, r: 1 - s * (1.5 * crest(r, 0.58, 0.24, 0.05) - 0.4)),
    # An accumulator takes up oil between the pressures at which its spring leaves one stop and meets the other
    Effect("accumulator_spring_has_two_stops", "torque", "piston_feed", "pressure", "difference", "m/bar", 4e-5,
           lambda s, p: -s * shelf(p, 2.6, 7.5, 1.6)),
    Effect("end_plate_turns_inside_out", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * passage(p, 5.5, 1.8)),
    # The mesh of a strainer folds over the bore, and is pushed open by a larger flow
    Effect("strainer_folds_and_is_pushed_open", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.4,
           lambda s, v: 1 + s * (1.4 * np.abs(np.sqrt(np.clip(v, 0, 0.03) / 0.005) - 1) - 0.7)),
    Effect("piston_pin_climbs_a_ramp_and_drops", "torque", "net_pressure", "piston", "difference", "bar", 1.0,
           lambda s, x: -s * crest(x, 0.0014, 0.0004, 0.0001)),
    # The lip of the seal rolls over on the way out, and is pressed on ever more on the way back
    Effect("seal_lip_rolls_over_on_the_way_out", "torque", "net_pressure", "driving_pressure", "difference", "bar", 1.0,
           lambda s, p: -np.sign(p) * np.minimum(
               np.abs(p), s * np.where(p > 0, 0.2 + 1.2 * hump(p, 2.8, 3), 0.1 + 0.4 * hinge(-p, 1, 0.3)))),
    # Plates
    Effect("hub_passes_its_resonance_with_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 + s * passage(v, 18, 6)),
    # Segments of the lining touch one after another; each loses its grip as the next one touches
    Effect("lining_segments_touch_one_after_another", "torque", "friction_coefficient", "contact_pressure", "ratio",
           "1", 0.15, lambda s, p: 1 + s * (1.6 * scallops(p + 0.4, 4.4) - 1)),
    # Layers of additives take over from each other at heats in a constant ratio
    Effect("additives_take_over_from_each_other", "torque", "friction_coefficient", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 + s * np.cos(2.4 * np.log((np.maximum(h, 0) + 150) / 700))),
    Effect("vapour_bubbles_hold_up_the_film", "torque", "friction_lag", "heat", "difference", "s", 0.025,
           lambda s, h: s * (0.15 + 1.6 * crest(h, 900, 350, 600))),
    Effect("cooler_bypass_is_open_for_a_while", "torque", "film_coefficient", "sequence", "ratio", "1", 1.2,
           lambda s, r: 1 + s * shelf(r, 0.3, 0.72, 0.14)),
    # Shafts, converter and load
    # Two rings of rubber in a row let go of the hub, each at its own twist
    Effect("rubber_rings_let_go_one_by_one", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 1.5e-4,
           lambda s, x: s * (0.2 + 0.6 * edge(x, 0.022, 0.003) + 0.8 * edge(x, 0.085, 0.006))),
    Effect("clutch_takes_the_charge_oil_in_between", "input speed", "converter_lag", "pressure", "difference", "s",
           0.05, lambda s, p: s * (0.2 + 1.3 * shelf(p, 2.2, 6, 1.2))),
    # An unloading valve empties the pump on the load between two speeds
    Effect("load_pump_is_unloaded_between_two_speeds", "output speed", "load_torque", "output_speed", "difference",
           "N m", 25.0, lambda s, w: s * (1 - 1.6 * shelf(w, 8, 21, 4))),
)
TENTH = (*TENTH_PHYSICAL, *TENTH_SENSORS, *TENTH_UNLISTED)
NEAR = {"pulsation_damper_has_lost_its_gas": (27, 29, 33, 35), "pressure_transmitter_wakes_up": (33, 36),
        "output_speed_is_timed_from_tooth_to_tooth": (36,)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a formula of the catalogue, or just 10 %."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(25, 37) if number not in NEAR.get(effect.name, ()))
           for effect in TENTH}
"""The benches on which a case may have each effect."""
