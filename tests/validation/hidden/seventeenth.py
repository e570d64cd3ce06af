"""Effects that no other list has: `SEVENTEENTH`, for the list `austral` of cases.py, on benches from `drawn109` on.

Units and scales are those of catalogue.py. The forms follow from wear, oil, electronics and installation: grips that
saturate and slip, valleys between two rises, amplitudes that set in and die out, soft mountings, flows that turn
turbulent, boiling, gaps that close, foams, creep in three stages, controllers that overcorrect, pairs of wells, tuned
traps, and drifts with a recovery.
"""

import numpy as np

from .effect import Effect
from .seventeenth_sensors import SEVENTEENTH_SENSORS
from .seventeenth_shapes import (
    boiling,
    closing,
    drifted,
    flutter,
    foam,
    grip,
    isolated,
    moody,
    notch,
    rebound,
    tunnel,
    wells,
)
from .seventeenth_unlisted import SEVENTEENTH_UNLISTED
from .twelfth_shapes import ramp

SEVENTEENTH_PHYSICAL = (
    # Line pressure and valve
    # The pilot of the relief valve begins to flutter at a speed, ever more, and is quiet again at a higher one
    Effect("relief_pilot_flutters_in_a_range_of_speeds", "pressure", "pressure_gain", "motor_speed", "ratio", "1", 0.06,
           lambda s, w: 1 - s * (1.5 * flutter(w, 124, 172, 8) - 0.5)),
    # The bushing of the armature sticks at slow changes, slides at faster ones, and is dragged by eddies at fast ones
    Effect("armature_bushing_sticks_slides_and_is_dragged", "pressure", "valve_current", "current_excess", "difference",
           "A", 0.02, lambda s, i: -s * np.sign(i) * 1.1 * tunnel(np.abs(i), 0.022, 0.35)),
    # The armature closes its gap with the current, and the pole saturates once they touch
    Effect("armature_closes_its_gap_and_the_pole_saturates", "pressure", "valve_current", "current", "difference", "A",
           0.02, lambda s, u: s * (1.5 * closing(u, 0.6, 0.09, 0.05) - 0.5)),
    # Piston
    # The oil ring rocks on its elastic drum at a speed, and is left behind above it
    Effect("oil_ring_rocks_on_its_drum_and_is_left_behind", "torque", "chamber_pressure", "input_speed", "difference",
           "bar", 0.6, lambda s, w: s * (1.5 * isolated(w, 88, 0.16) - 0.5)),
    # The controller of the oil's heater is exchanged: the new one overcorrects, and then holds another temperature
    Effect("new_heater_controller_overcorrects_and_stays_off", "torque", "oil_temperature_gain", "sequence", "ratio",
           "1", 0.12, lambda s, r: 1 + s * 1.2 * rebound(r, 0.27, 0.05, 0.2, 0.7)),
    # The linings settle in a series of hot runs, and recover in part in a rest
    Effect("linings_settle_and_recover_in_part", "torque", "clearance", "sequence", "ratio", "1", 0.12,
           lambda s, r: 1 + s * (1.5 * drifted(r, 0.08, 0.54, 0.06, 0.09, 0.2) - 0.5)),
    # A shuttle in the feed rests in two positions, and takes oil on its way between them and beyond
    Effect("shuttle_in_the_feed_rests_in_two_positions", "torque", "piston_feed", "pressure", "difference", "m/bar",
           8e-5, lambda s, p: -s * 1.2 * wells(p, 5.2, 3.1)),
    # The paper between the plates yields like a foam, and is dense at a high pressure
    Effect("paper_between_the_plates_yields_like_a_foam", "torque", "clearance", "pressure", "ratio", "1", 0.12,
           lambda s, p: 1 + s * (1.5 * foam(np.maximum(p, 0), 0.8, 9) - 0.4)),
    # The feed cavitates from a flow on, and is choked by its bubbles until they are carried off
    Effect("feed_is_choked_by_bubbles_until_they_are_carried_off", "torque", "piston_rate", "free_piston_rate", "ratio",
           "1", 0.5, lambda s, v: (1 + s) ** (0.9 * (tunnel(v, 0.0032, 0.0165) - 0.6))),
    # A clip pushes the piston on from a stroke on, and holds it back behind its top
    Effect("clip_pushes_the_piston_and_holds_it_back", "torque", "net_pressure", "piston", "difference", "bar", 1.2,
           lambda s, x: s * 1.2 * rebound(x, 0.0006, 0.00015, 0.0005, 0.8)),
    # The lip is lubricated with the pressure, until it is pressed through its film; on the way back it is drawn on
    Effect("seal_lip_is_pressed_through_its_film", "torque", "net_pressure", "driving_pressure", "difference", "bar",
           1.0, lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * np.where(
               p > 0, 1.2 * moody(p, 4.6, 0.35), 0.4 * ramp(-p, 0, 0.8)))),
    # Plates
    # The rubbery binder of the linings grips like a tyre, most at one slip
    Effect("binder_grips_like_a_tyre", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 + s * (1.5 * grip(v, 12, 1.85) - 0.7)),
    # The plates squeal from a pressure on, ever more, and are quiet again once they are pressed firmly
    Effect("plates_squeal_in_a_range_of_pressures", "torque", "friction_coefficient", "contact_pressure", "ratio", "1",
           0.12, lambda s, p: 1 - s * (1.6 * flutter(p, 2.6, 7, 0.9) - 0.6)),
    # The oil in the grooves boils ever more, until a film of vapour keeps it from the plates
    Effect("vapour_film_keeps_the_oil_from_the_plates", "torque", "friction_coefficient", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 + s * (1.5 * boiling(h, 1300, 2600) - 0.6)),
    # The flow through the grooves turns turbulent at a speed
    Effect("flow_in_the_grooves_turns_turbulent", "torque", "friction_lag", "input_speed", "difference", "s", 0.022,
           lambda s, w: s * (0.1 + 1.4 * moody(w, 105, 5))),
    # The oil takes up water, which is boiled out, and is then oxidized; viscosities differ by a power
    Effect("oil_takes_up_water_and_is_oxidized", "torque", "film_coefficient", "sequence", "ratio", "1", 4.0,
           lambda s, r: (1 + s) ** (0.85 * (tunnel(r, 0.16, 1.0) - 0.5))),
    # Shafts, converter and load
    # The balls of the coupling rest in two hollows each
    Effect("coupling_balls_rest_in_two_hollows", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)",
           1.2e-4, lambda s, x: s * (0.25 + wells(x, 0.042, 0.021))),
    # The wheel of the converter flutters in a range of slips, and its oil follows slowly then
    Effect("converter_wheel_flutters_in_a_range_of_slips", "input speed", "converter_lag", "slip", "difference", "s",
           0.05, lambda s, v: s * (0.15 + 1.4 * flutter(v, 9, 33, 4))),
    # A flywheel on the drum of the load is tuned to a speed, at which it takes all of the drag
    Effect("load_drum_is_relieved_by_a_tuned_wheel", "output speed", "load_torque", "output_speed", "difference", "N m",
           30.0, lambda s, w: s * (1.4 * notch(w, 15, 9) - 0.4)),
)
SEVENTEENTH = (*SEVENTEENTH_PHYSICAL, *SEVENTEENTH_SENSORS, *SEVENTEENTH_UNLISTED)
NEAR = {"relief_pilot_flutters_in_a_range_of_speeds": (109, 112, 113, 115, 116, 117, 118),
        "pressure_screen_silts_up_in_each_run": (113,)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a formula of the catalogue, or constant."""
BENCHES = {effect.name: tuple(f"drawn{number}" for number in range(109, 121)
                              if number not in NEAR.get(effect.name, ())) for effect in SEVENTEENTH}
"""The benches on which a case may have each effect."""
