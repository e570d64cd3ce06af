"""Effects in pairs that a catalogue would not list, for the list `lunar`; part of `TWENTYFIRST` (twentyfirst.py).

The comment of each one says why a bench could show it. No earlier list has six of the pairs, which are those of the
first six effects.
"""

from .effect import Effect
from .twentyfirst_shapes import (
    absorbed,
    activity,
    branches,
    dosage,
    ordering,
    pulled,
    regimes,
    relaxing,
    seizing,
    shock,
    stopping,
)

TWENTYFIRST_UNLISTED = (
    # Valve current over output speed: a magnet on the output induces a current in the valve's wire once it turns fast
    # enough, most of which a filter takes away from a higher speed on
    Effect("valve_wire_lies_beside_a_magnet_of_the_output", "pressure", "valve_current", "output_speed", "difference",
           "A", 0.02, lambda s, w: s * (1.3 * dosage(w, 5, 4, 15, 9, 0.35) - 0.2)),
    # Valve current over the time in contact: a relay is closed by the bite and opened by a timer, and the driver of the
    # valve makes up for most of both
    Effect("valve_driver_makes_up_for_a_relay_of_the_bite", "pressure", "valve_current", "contact_time", "difference",
           "A", 0.02, lambda s, t: s * (1.2 * relaxing(t, 0.008, 0.07, 0.3, (0.06, 1.0), (0.24, -1.2)) - 0.2)),
    # Contact pressure over the current: the field of the coil, which is beside the drum, holds the steel plates back
    # ever more, until it is strong enough to pull them over
    Effect("coil_beside_the_drum_pulls_the_plates_over", "torque", "contact_pressure", "current", "ratio", "1", 0.12,
           lambda s, u: 1 + s * (1.1 * shock(u, 0.56, 0.01, 0.1) - 0.3)),
    # Input speed sensor over the slip: the plates sing, and the air gap of the pickup sets to the tone at a slip
    Effect("input_pickup_sets_to_the_tone_of_the_plates", "input speed", "input_speed_sensor", "slip", "difference",
           "rad/s", 2.0, lambda s, v: s * (1.8 * ordering(v, 15, 4, 9) - 0.6)),
    # Chamber pressure over the run order: the vent of the chamber silts up ever faster, until it is pierced
    Effect("chamber_vent_silts_up_and_is_pierced", "torque", "chamber_pressure", "sequence", "difference", "bar", 0.6,
           lambda s, r: s * (1.6 * stopping(r, 0.68, 0.012) - 0.7)),
    # Friction over the current: iron dust from the plates is held by the field of the coil, in layers that form, turn
    # over and are packed
    Effect("iron_dust_on_the_plates_follows_the_coil", "torque", "friction_coefficient", "current", "ratio", "1", 0.12,
           lambda s, u: 1 + s * (regimes(u, 0.008, (0.4, 9), (0.51, -10), (0.6, 0), (0.64, 12), (0.72, 0)) - 0.6)),
    # Load torque over heat: the oil of the plates lubricates a bearing of the load, which seizes when it is hot
    Effect("load_bearing_seizes_in_oil_of_hot_plates", "output speed", "load_torque", "heat", "difference", "N m", 30.0,
           lambda s, h: s * (1.3 * seizing(h, 450, 1900) - 0.8)),
    # Torque sensor over output speed: its slip rings lift off from their brushes by the speed, except at one at which
    # the brushes swing along
    Effect("torque_brushes_lift_off_but_at_a_speed", "torque", "output_torque_sensor", "output_speed", "difference",
           "N m", 25.0, lambda s, w: s * (1.3 * absorbed(w, 4, 15, 2.2) - 0.4)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    # Line pressure: a polymer in the oil thickens it ever faster as it uncoils, until it goes to pieces
    Effect("polymer_of_the_oil_goes_to_pieces", "pressure", "pressure_gain", "oil_temperature", "ratio", "1", 0.06,
           lambda s, c: 1 + s * (1.5 * activity(c, 8, 66, 1.0, 0.6) - 0.6)),
    # Input speed sensor: the glue of its bracket softens, sets by its hardener, and flows
    Effect("input_bracket_glue_gives_way_in_three_ways", "input speed", "input_speed_sensor", "oil_temperature",
           "difference", "rad/s", 2.0, lambda s, c: s * (1.5 * branches(c, 44, 88) - 0.5)),
    # Friction: a soap of the oil forms a coat on the plates, which yields, grows hard and comes off
    Effect("soap_on_the_plates_yields_and_comes_off", "torque", "friction_coefficient", "oil_temperature", "ratio", "1",
           0.12, lambda s, c: 1 + s * (1.4 * pulled(c - 41, 38) - 0.9)),
)
