"""Effects that no other list has: `ELEVENTH`, for the list `farther` of cases.py, on benches from `drawn37` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: standing
waves, steps that swing, bumps between dips, sharp valleys, arches, pointed peaks, and drifts that are set back. No
earlier list has the form for the same pair.
"""

import numpy as np

from .effect import Effect
from .eleventh_sensors import ELEVENTH_SENSORS
from .eleventh_shapes import arch, brim, comb, fork, settling
from .eleventh_unlisted import ELEVENTH_UNLISTED
from .fifth import passage
from .ninth_shapes import hump
from .tenth_shapes import crest, scallops, shelf

ELEVENTH_PHYSICAL = (
    # Line pressure and valve
    # The pulses of the pump build up standing waves in a line that is too long, at several speeds
    Effect("supply_line_stands_in_waves", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 + s * (1.5 * comb(w - 10, 47, 5) - 0.7)),
    # Eddy currents take from the pull whenever the current changes, up or down
    Effect("eddy_currents_weaken_the_pull_both_ways", "pressure", "valve_current", "current_excess", "difference", "A",
           0.02, lambda s, i: -s * np.abs(i) ** 1.3 / (np.abs(i) ** 1.3 + 0.03**1.3)),
    # The edge of the armature passes that of the pole: the flux crosses there, and leaks on either side
    Effect("armature_edge_passes_the_pole", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * 1.4 * brim(u, 0.44, 0.08)),
    # Piston
    # The oil ring closes at a speed, and sloshes above it
    Effect("oil_ring_closes_and_sloshes", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.5,
           lambda s, w: s * (settling(w, 84, 46, 45) - 0.3)),
    # The controller of the oil cooler overshoots after the start, and settles over the day
    Effect("cooler_controller_settles", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * np.cos(2 * np.pi * r / 0.42) * np.exp(-np.maximum(r, 0) / 0.7)),
    # The linings are dried in the first runs, and take up water from the oil again
    Effect("linings_dry_and_take_up_water", "torque", "clearance", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 - s * (0.9 * fork(np.maximum(r, 0) + 0.06, 0.32) - 0.5)),
    # Two hoses in a row swell, each at its own pressure
    Effect("two_hoses_swell_one_after_the_other", "torque", "piston_feed", "pressure", "difference", "m/bar", 6e-5,
           lambda s, p: -s * (np.exp(-(((p - 2.2) / 0.8) ** 2)) + 0.8 * np.exp(-(((p - 7.5) / 1.6) ** 2)))),
    # The snap ring is bent up ever more until it jumps back into its seat
    Effect("snap_ring_jumps_into_its_seat", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * (1.5 * crest(p, 5, 2.6, 0.7) - 0.4)),
    # The flow in the feed turns over from laminar to turbulent, and hangs between both
    Effect("feed_flow_turns_over", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.3,
           lambda s, v: 1 - s * passage(v, 0.0058, 0.0022)),
    Effect("bore_is_out_of_round_in_a_zone", "torque", "net_pressure", "piston", "difference", "bar", 1.0,
           lambda s, x: -s * arch(x, 0.0006, 0.0017)),
    # The ring twists in its groove up to a pressure, and snaps back; on the way back it twists at once
    Effect("seal_ring_twists_and_snaps_back", "torque", "net_pressure", "driving_pressure", "difference", "bar", 1.2,
           lambda s, p: -np.sign(p) * np.minimum(
               np.abs(p), s * np.where(p > 0, 0.2 + 1.2 * crest(p, 3.4, 1.5, 0.6),
                                               0.3 + 0.5 * crest(-p, 1, 0.5, 0.5)))),
    # Plates
    # Asperities are shed up to a slip, from which on the oil between the plates is sheared
    Effect("mixed_friction_ends_at_a_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 + s * (0.7 * fork(np.maximum(v, 0) + 1.2, 11) - 0.5)),
    # The edges of the grooves scrape the oil off at one pressure, and float on it below and above
    Effect("groove_edges_scrape_at_a_pressure", "torque", "friction_coefficient", "contact_pressure", "ratio", "1",
           0.15, lambda s, p: 1 + s * (1.4 * brim(p, 5, 1.9) - 0.2)),
    # One additive leaves the plates at a heat, before another one reacts at a higher one
    Effect("plates_are_bare_between_two_heats", "torque", "friction_coefficient", "heat", "ratio", "1", 0.15,
           lambda s, h: 1 - s * (1.4 * shelf(h, 650, 2300, 450) - 0.5)),
    # The grooves hold their oil until the plates on the output turn it out
    Effect("grooves_are_emptied_by_the_output", "torque", "friction_lag", "output_speed", "difference", "s", 0.025,
           lambda s, w: s * (0.15 + 1.5 * np.exp(-((np.maximum(w, 0) / 9) ** 1.6)))),
    # Soot thickens the oil until it is exchanged
    Effect("oil_thickens_with_soot_and_is_exchanged", "torque", "film_coefficient", "sequence", "ratio", "1", 1.2,
           lambda s, r: 1 + s * 1.3 * crest(r, 0.63, 0.28, 0.05)),
    # Shafts, converter and load
    # The pins of the coupling roll from one dent of their bores to the next
    Effect("coupling_pins_roll_over_dents", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 1.5e-4,
           lambda s, x: s * (0.25 + 1.2 * scallops(x, 0.055))),
    # The pump on the output takes the charge oil while it is being filled
    Effect("output_pump_takes_the_charge_oil_as_it_fills", "input speed", "converter_lag", "output_speed", "difference",
           "s", 0.05, lambda s, w: s * (0.2 + 1.3 * hump(w, 8, 1.6))),
    # The face seal of the load runs ever drier, until a film of air lifts it
    Effect("load_seal_runs_dry_until_it_lifts", "output speed", "load_torque", "output_speed", "difference", "N m",
           35.0, lambda s, w: s * 1.3 * crest(w, 15, 7, 2.5)),
)
ELEVENTH = (*ELEVENTH_PHYSICAL, *ELEVENTH_SENSORS, *ELEVENTH_UNLISTED)
NEAR = {"supply_line_stands_in_waves": (43, 44, 46), "pressure_hose_hammers": (39,),
        "output_pulses_are_timed_in_groups": (39, 46, 47)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a formula of the catalogue, or just 10 %."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(37, 49) if number not in NEAR.get(effect.name, ()))
           for effect in ELEVENTH}
"""The benches on which a case may have each effect."""
