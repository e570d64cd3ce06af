"""Effects that no other list has: `FOURTEENTH`, for the list `distant` of cases.py, on benches from `drawn73` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: teeth, combs,
resonances, pointed peaks, bumps between two dips, soft steps, steps that swing, flat valleys, and level parts between
two rises. No earlier list has the form for the same pair.
"""

import numpy as np

from .effect import Effect
from .eleventh_shapes import brim, comb, settling
from .fourteenth_sensors import FOURTEENTH_SENSORS
from .fourteenth_shapes import landing, peaks, teeth
from .fourteenth_unlisted import FOURTEENTH_UNLISTED
from .ninth_shapes import burr, hump
from .tenth_shapes import crest, scallops, shelf
from .thirteenth_shapes import stairs, treads
from .twelfth_shapes import eased, ramp, swing, trough

FOURTEENTH_PHYSICAL = (
    # Line pressure and valve
    # The drive of the pump shifts up twice: within a gear the flow rises with the speed
    Effect("pump_drive_shifts_up_at_two_speeds", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 + s * (1.5 * teeth(w - 84, 44, 0.15) - 0.7)),
    # The armature climbs a burr on its way up, and drops behind it; on the way down it only leans on its guide
    Effect("armature_climbs_a_burr_on_its_way_up", "pressure", "valve_current", "current_excess", "difference", "A",
           0.02, lambda s, i: s * (0.5 * eased(-i, 0.01, 0.05) - 1.4 * hump(i, 0.04, 4))),
    # The spool lands on a cushion of oil, and bounces
    Effect("spool_lands_on_a_cushion_and_bounces", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * (landing(u, 0.33, 0.22, 0.25) - 0.5)),
    # Piston
    # The drain bores of the drum open one after another, each at its own speed
    Effect("drain_bores_of_the_drum_open_one_after_another", "torque", "chamber_pressure", "input_speed", "difference",
           "bar", 0.6, lambda s, w: s * (1.4 * teeth(w - 22, 52, 0.2) - 0.3)),
    # A neighbouring rig sheds its heat into the same tank now and then
    Effect("neighbouring_rig_sheds_its_heat_now_and_then", "torque", "oil_temperature_gain", "sequence", "ratio", "1",
           0.17, lambda s, r: 1 + s * (1.4 * comb(r - 0.19, 0.36, 8) - 0.4)),
    # The linings are pressed together by hot runs, and then soak up the oil of a long rest
    Effect("linings_are_pressed_and_soak_up_oil", "torque", "clearance", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 - s * swing(r, 0.47, 0.15)),
    # A bellows in the feed opens fold by fold
    Effect("bellows_in_the_feed_opens_fold_by_fold", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * 1.2 * scallops(p, 4.6)),
    # The snap ring jumps out of its seat, and the load presses it back
    Effect("snap_ring_jumps_out_and_is_pressed_back", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * (1.5 * burr(p, 4.2, 0.3, 4) - 0.4)),
    # The strainer whistles at two flows, and lets less oil pass then
    Effect("strainer_whistles_at_two_flows", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.3,
           lambda s, v: 1 - s * (peaks(v, (0.0045, 0.0012, 1.2), (0.0115, 0.002, 1.0)) - 0.4)),
    # A second and a third spring come in on the way, each within a short stroke
    Effect("two_more_springs_come_in_on_the_way", "torque", "net_pressure", "piston", "difference", "bar", 0.7,
           lambda s, x: -s * treads(x, (0.0006, 0.0008, 0.6), (0.0014, 0.0016, 0.8))),
    # The seal sings at two pressures, and rubs more then
    Effect("seal_sings_at_two_pressures", "torque", "net_pressure", "driving_pressure", "difference", "bar", 1.0,
           lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(
               p > 0, 0.15 + peaks(p, (2.2, 0.5, 1.1), (6, 1.0, 0.9)), 0.4 * ramp(-p, 0, 0.6)))),
    # Plates
    # Judder sets in at a slip, and dies out above it
    Effect("judder_sets_in_at_a_slip_and_dies_out", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 - s * (settling(v, 7, 15, 18) - 0.6)),
    # A hard grain of the lining carries more and more, until it is crushed
    Effect("lining_grains_are_crushed_at_a_pressure", "torque", "friction_coefficient", "contact_pressure", "ratio",
           "1", 0.15, lambda s, p: 1 + s * (1.6 * crest(p, 5.4, 2.2, 0.5) - 0.6)),
    # Deposits flash off one after another, each at its own heat
    Effect("deposits_flash_off_at_several_heats", "torque", "friction_coefficient", "heat", "ratio", "1", 0.15,
           lambda s, h: 1 - s * (1.5 * comb(h - 550, 1300, 8) - 0.5)),
    # The pores hold their film between two pressures: below it leaves by the grooves, above through the lining
    Effect("pores_hold_their_film_between_two_pressures", "torque", "friction_lag", "contact_pressure", "difference",
           "s", 0.025, lambda s, p: s * (0.15 + 1.5 * shelf(p, 3, 7.5, 1.5))),
    # Two sumps, of a thick and of a thin oil, serve the bench by turns; viscosities differ by a power
    Effect("two_sumps_serve_by_turns", "torque", "film_coefficient", "sequence", "ratio", "1", 1.2,
           lambda s, r: (1 + s) ** (0.65 * (1 - stairs(r, (0.28, 1.4), (0.47, 0.0), (0.83, 1.4))))),
    # Shafts, converter and load
    # The leaf springs of the coupling lie flat on each other, and buckle at a larger twist
    Effect("leaf_springs_lie_flat_and_buckle", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 1.2e-4,
           lambda s, x: s * (0.9 + 0.75 * swing(x, 0.045, 0.022))),
    # The oil of the converter is cold in the morning and in the evening, and follows slowly
    Effect("converter_oil_is_cold_at_both_ends_of_the_day", "input speed", "converter_lag", "sequence", "difference",
           "s", 0.05, lambda s, r: s * (0.15 + 1.4 * trough(r, 0.3, 0.6, 0.35))),
    # The tyre of the load hops at one speed, and rolls easily beside it
    Effect("load_tyre_hops_at_a_speed", "output speed", "load_torque", "output_speed", "difference", "N m", 30.0,
           lambda s, w: s * 1.4 * brim(w, 14, 5)),
)
FOURTEENTH = (*FOURTEENTH_PHYSICAL, *FOURTEENTH_SENSORS, *FOURTEENTH_UNLISTED)
NEAR: dict[str, tuple[int, ...]] = {"pump_drive_shifts_up_at_two_speeds": (73, 75, 79, 83)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a formula of the catalogue, or just 10 %."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(73, 85)
                              if number not in NEAR.get(effect.name, ())) for effect in FOURTEENTH}
"""The benches on which a case may have each effect."""
