"""Effects that no other list has: `FIFTEENTH`, for the list `overseas` of cases.py, on benches from `drawn85` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: trains of
waves, beats, waves that become ever longer, arches of a ball that bounces, teeth in the logarithm, half ellipses,
cusps, logarithmic peaks, two humps with a zero between them, and level parts between a dip and a bump.
"""

import numpy as np

from .effect import Effect
from .fifteenth_sensors import FIFTEENTH_SENSORS
from .fifteenth_shapes import beat, bounces, cusps, dome, fringes, gears, lull, packet, saddle, spike
from .fifteenth_unlisted import FIFTEENTH_UNLISTED
from .twelfth_shapes import ramp

FIFTEENTH_PHYSICAL = (
    # Line pressure and valve
    # Two pumps on one shaft fill each other's gaps at one speed, and pulse together beside it
    Effect("twin_pumps_fill_each_others_gaps_at_a_speed", "pressure", "pressure_gain", "motor_speed", "ratio", "1",
           0.06, lambda s, w: 1 + s * (1.5 * saddle(w, 148, 24) - 0.7)),
    # Grease holds the armature: it gives way to slow changes, is torn by fast ones, and drags in between
    Effect("armature_is_dragged_by_grease", "pressure", "valve_current", "current_excess", "difference", "A", 0.02,
           lambda s, i: -s * np.where(i > 0, 1.4 * lull(i, 0, 0.04), 0.8 * lull(i, 0, 0.09))),
    # The dither of the driver beats with its chopper
    Effect("dither_beats_with_the_chopper", "pressure", "valve_current", "current", "difference", "A", 0.02,
           lambda s, u: s * beat(u - 0.3, 0.33, 0.21)),
    # Piston
    # The oil ring is dammed by a round weir between the speeds at which it meets its foot and its top
    Effect("oil_ring_meets_a_round_weir", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.6,
           lambda s, w: s * (1.4 * dome(w, 55, 140) - 0.3)),
    # The oil is cooled by the morning's hall and warmed by the evening's, and even in between
    Effect("hall_cools_the_oil_early_and_warms_it_late", "torque", "oil_temperature_gain", "sequence", "ratio", "1",
           0.12, lambda s, r: 1 + s * lull(r, 0.47, 0.22)),
    # The plates were thrown apart, and come to rest like a ball
    Effect("plates_come_to_rest_like_a_ball", "torque", "clearance", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * (1.5 * bounces(r, 0.06, 0.42, 0.7) - 0.5)),
    # The folds of a hose lock at pressures that are evenly spaced, and give way at once beside them
    Effect("folds_of_the_hose_lock_and_give_way", "torque", "piston_feed", "pressure", "difference", "m/bar", 8e-5,
           lambda s, p: -s * 1.4 * cusps(p - 2.4, 4.4)),
    # Two waved plates lie in the pack, of different stiffness
    Effect("two_waved_plates_lie_in_the_pack", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * 0.9 * beat(p - 1, 7.2, 4.4)),
    # Vortices behind a ball in the feed lock to it, ever fewer with the flow; resistances differ by a power
    Effect("vortices_lock_to_the_ball_in_the_feed", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.3,
           lambda s, v: (1 + s) ** (0.9 * fringes(v, 0.018, 0.006))),
    # A loose ring is struck by the piston, and comes back against it ever lower
    Effect("loose_ring_bounces_against_the_piston", "torque", "net_pressure", "piston", "difference", "bar", 1.2,
           lambda s, x: -s * 1.3 * bounces(x, 0.0003, 0.001, 0.7)),
    # The lip flutters about a pressure on the way out; on the way back it is drawn on
    Effect("seal_lip_flutters_about_a_pressure", "torque", "net_pressure", "driving_pressure", "difference", "bar", 1.0,
           lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(
               p > 0, 0.65 + 0.6 * packet(p, 3.6, 2.6, 2.4), 0.4 * ramp(-p, 0, 0.8)))),
    # Plates
    # The film is critical at a slip: friction grows without bound on both sides, as far as the plates are even
    Effect("film_is_critical_at_a_slip", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 + s * (1.6 * spike(v, 15, 36, 14) - 0.5)),
    # Fibres slip from mesh to mesh, at pressures in a constant ratio
    Effect("fibres_slip_from_mesh_to_mesh", "torque", "friction_coefficient", "contact_pressure", "ratio", "1", 0.15,
           lambda s, p: 1 + s * (1.4 * gears(np.maximum(p, 0) + 1, 2.0, 0.2) - 0.7)),
    # Two resins soften at a heat each, between which the first has hardened again
    Effect("two_resins_soften_at_a_heat_each", "torque", "friction_coefficient", "heat", "ratio", "1", 0.15,
           lambda s, h: 1 - s * (1.5 * saddle(h, 1350, 750) - 0.5)),
    # A spout fills the grooves whenever a bore of the output passes it
    Effect("spout_fills_the_grooves_once_per_turn", "torque", "friction_lag", "output_position", "difference", "s",
           0.025, lambda s, x: s * (0.2 + 1.6 * cusps(x - 1.1, 4.6))),
    # The tank is topped up at ever longer intervals; viscosities differ by a power
    Effect("tank_is_topped_up_ever_more_rarely", "torque", "film_coefficient", "sequence", "ratio", "1", 1.2,
           lambda s, r: (1 + s) ** (0.6 * fringes(r, 0.62, 0.22))),
    # Shafts, converter and load
    # The rollers of the coupling climb tooth after tooth, each twice as wide as the last
    Effect("coupling_rollers_climb_ever_wider_teeth", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)",
           1.2e-4, lambda s, x: s * (0.4 + 1.1 * gears(np.maximum(x, 0) / 0.014 + 1, 2.0, 0.2))),
    # The charge valve hangs on the wire of the clutch's valve, and is disturbed below and above a current
    Effect("charge_valve_hangs_on_the_wire_of_the_clutch", "input speed", "converter_lag", "current", "difference", "s",
           0.05, lambda s, u: s * (0.2 + 1.4 * saddle(u, 0.5, 0.17))),
    # The ends of the load's drum shake at two speeds, between which they balance each other
    Effect("load_drum_shakes_on_both_sides_of_a_speed", "output speed", "load_torque", "output_speed", "difference",
           "N m", 30.0, lambda s, w: s * (1.5 * saddle(w, 15, 9) - 0.4)),
)
FIFTEENTH = (*FIFTEENTH_PHYSICAL, *FIFTEENTH_SENSORS, *FIFTEENTH_UNLISTED)
NEAR = {"twin_pumps_fill_each_others_gaps_at_a_speed": (89, 93, 95)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a formula of the catalogue, or just 10 %."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(85, 97)
                              if number not in NEAR.get(effect.name, ())) for effect in FIFTEENTH}
"""The benches on which a case may have each effect."""
