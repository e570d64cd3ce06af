"""Effects that no other list has: `EIGHTH`, for the list `beyond` of cases.py, on the drawn benches only.

Units and scales are those of catalogue.py. The forms follow from damage and faults of machines: waves over a root or
with a modulated phase, waves with flat tops and narrow pulses, overshooting steps, zigzags, wells, and growing waves.
"""

import numpy as np
from scipy.special import airy, sici

from .effect import Effect
from .eighth_sensors import EIGHTH_SENSORS
from .eighth_unlisted import EIGHTH_UNLISTED
from .eighth_waves import flat, modulated, pulses

EIGHTH_PHYSICAL = (
    # Valve
    Effect("magnet_overshoots_its_remanence", "pressure", "valve_current", "current_excess", "difference", "A", 0.02,
           lambda s, i: -s * sici(i / 0.02)[0] / 1.85),
    Effect("spool_edges_are_chipped", "pressure", "valve_current", "current", "difference", "A", 0.025,
           lambda s, u: s * airy((0.2 - u) / 0.055)[0] / 0.54),
    # Piston
    Effect("oil_ring_sloshes", "torque", "chamber_pressure", "input_speed", "difference", "bar", 0.5,
           lambda s, w: s * modulated(w / 75, 0.35)),
    Effect("oil_is_heated_by_turns", "torque", "oil_temperature_gain", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * flat(1.4 * r + 0.1)),
    Effect("lining_flakes_jam_and_leave", "torque", "clearance", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * 1.2 * np.maximum(r, 0) ** 0.4 * np.cos(3.4 * np.pi * r)),
    Effect("plates_snap_through_like_lids", "torque", "clearance", "pressure", "ratio", "1", 0.1,
           lambda s, p: 1 + s * flat(p / 6 + 0.05)),
    Effect("feed_ball_dances", "torque", "piston_rate", "free_piston_rate", "ratio", "1", 0.3,
           lambda s, v: 1 + s * pulses(v / 0.011, 0.9)),
    Effect("bore_is_dented", "torque", "net_pressure", "piston", "difference", "bar", 0.8,
           lambda s, x: s * np.interp(x, [2e-4, 6e-4, 9e-4, 1.3e-3, 1.6e-3, 2.1e-3, 2.6e-3],
                               [0, 1, -0.7, 0.9, -1, 0.9, -0.6])),
    Effect("piston_ring_seats_late", "torque", "net_pressure", "driving_pressure", "difference", "bar", 1.0,
           lambda s, p: -np.sign(p) * np.minimum(np.abs(p), s * (0.55 + 0.45 * np.cos(np.pi * np.sqrt(np.abs(p)))))),
    # Plates
    Effect("plates_chatter_ever_slower", "torque", "friction_coefficient", "slip", "ratio", "1", 0.15,
           lambda s, v: 1 + s * np.sin(2 * np.pi * np.sqrt(np.maximum(v, 0) / 11))),
    Effect("rows_of_pores_open_and_close", "torque", "friction_coefficient", "contact_pressure", "ratio", "1", 0.15,
           lambda s, p: 1 + s * pulses(p / 4, 0.8)),
    Effect("resin_chars_in_layers", "torque", "friction_coefficient", "heat", "ratio", "1", 0.15,
           lambda s, h: 1 - s * modulated(np.maximum(h, 0) / 3500, 0.4)),
    Effect("debris_clogs_the_grooves_by_turns", "torque", "friction_lag", "energy", "difference", "s", 0.025,
           lambda s, e: s * (0.2 + 1.2 * np.sin(np.maximum(e, 0) / 3000) ** 2)),
    Effect("sump_is_churned_and_settles", "torque", "film_coefficient", "sequence", "ratio", "1", 1.2,
           lambda s, r: 1 + s * np.exp(-np.mod(2.3 * r, 1.0) / 0.3)),
    # Shafts, converter and load
    Effect("coupling_rollers_ride_up", "torque", "shaft_compliance", "twist", "difference", "rad/(N m)", 1e-4,
           lambda s, x: s * (0.75 + 0.55 * flat(x / 0.12 + 0.25))),
    Effect("converter_charge_pumps", "input speed", "converter_lag", "time", "difference", "s", 0.05,
           lambda s, t: s * (0.3 + 1.2 * np.sin(2 * np.pi * t / 0.55) ** 4)),
    Effect("load_hose_whips", "output speed", "load_torque", "output_speed", "difference", "N m", 20.0,
           lambda s, w: s * np.maximum(w, 0) / 22 * np.cos(np.maximum(w, 0) / 5)),
)
EIGHTH = (*EIGHTH_PHYSICAL, *EIGHTH_SENSORS, *EIGHTH_UNLISTED)
NEAR = {"pressure_hose_is_flat_until_it_is_filled": (9, 10),
        "torque_amplifier_is_tuned_for_another_cable": (1, 3, 6, 7, 9, 10, 12)}
"""Numbers of the drawn benches on which a form is less than 10 % away from a formula of the catalogue, or just 10 %."""
BENCHES = {effect.name: tuple(f"drawn{number:02}" for number in range(1, 13) if number not in NEAR.get(effect.name, ()))
           for effect in EIGHTH}
"""The benches on which a case may have each effect."""
