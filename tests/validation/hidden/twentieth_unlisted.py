"""Effects in pairs that a catalogue would not list, for the list `glacial`; part of `TWENTIETH` (twentieth.py).

The comment of each one says why a bench could show it. No earlier list has five of the pairs, which are those of the
first five effects.
"""

import numpy as np

from .effect import Effect
from .twentieth_shapes import (
    doubling,
    locking,
    rainbow,
    regrown,
    shingles,
    smoothed,
    stalled,
    trapped,
    twisted,
    warble,
)

TWENTIETH_UNLISTED = (
    # Valve current over the piston: the flow that the piston draws pulls the armature along, and its pulses are trapped
    # in the chamber of the spool at the strokes where that resonates with the feed
    Effect("armature_is_pulled_as_the_piston_draws", "pressure", "valve_current", "piston", "difference", "A", 0.02,
           lambda s, x: s * trapped(x, 0.0014, 0.0004)),
    # Valve current over heat: the hot plates warm the housing of the valve, whose parts expand by
    # turns, so that its gap opens and closes in two rhythms
    Effect("valve_gap_opens_and_closes_with_the_heat", "pressure", "valve_current", "heat", "difference", "A", 0.02,
           lambda s, h: s * warble(h, 2600)),
    # Piston rate over time: another clutch on the feed is filled in waves from the command on, which end at once
    Effect("feed_is_shared_in_waves_after_the_command", "torque", "piston_rate", "time", "ratio", "1", 0.4,
           lambda s, t: (1 + s) ** (0.9 * rainbow(t, 0.55, 0.07))),
    # Chamber pressure over heat: the hot plates boil oil in pores of the piston, which a film fills again at each crest
    Effect("pores_of_the_piston_boil_and_are_filled", "torque", "chamber_pressure", "heat", "difference", "bar", 0.6,
           lambda s, h: s * (1.6 * smoothed(np.maximum(h, 0), 1400, 700) - 1.0)),
    # Input speed sensor over the piston: the piston pushes the bracket of the pickup along, which follows in steps
    Effect("input_pickup_follows_the_piston_in_steps", "input speed", "input_speed_sensor", "piston", "difference",
           "rad/s", 2.0, lambda s, x: s * locking(x, 0.0002, 0.0026)),
    # Load torque over time: the base of the load swings from the command on, and every other swing is lost by and by
    Effect("load_base_loses_every_other_swing", "output speed", "load_torque", "time", "difference", "N m", 30.0,
           lambda s, t: s * doubling(t - 0.1, 0.28, 0.1, 0.6)),
    # Converter torque over the pressure: a vane in the charge line is turned by the pressure of the clutch, and stalls
    Effect("vane_in_the_charge_line_stalls", "input speed", "converter_torque", "pressure", "ratio", "1", 0.08,
           lambda s, p: 1 - s * (1.5 * stalled(p, 2.6, 12) - 0.6)),
    # Torque sensor over the time in contact: foam grows on the hot flange, and is thrown off
    Effect("foam_on_the_torque_flange_is_thrown_off", "torque", "output_torque_sensor", "contact_time", "difference",
           "N m", 25.0, lambda s, t: s * (1.4 * regrown(t, 26, (0, 0.08), (0.26, 0.2), (0.5, 0.05)) - 0.5)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    # Output speed sensor: its holder expands, and slips back over the marks of its clamp
    Effect("output_pickup_holder_slips_over_its_marks", "output speed", "output_speed_sensor", "oil_temperature",
           "difference", "rad/s", 1.5, lambda s, c: s * (1.5 * shingles(c, 43, 60, 86, 4) - 0.3)),
    # Contact pressure: fibres of the linings untwist from a temperature on
    Effect("fibres_of_the_linings_untwist_in_warm_oil", "torque", "contact_pressure", "oil_temperature", "ratio", "1",
           0.12, lambda s, c: 1 + s * (1.4 * twisted(c, 47, 88, 2) - 0.6)),
    # Piston gain: the flap of the cooler is turned by a spring in the warm oil, and its flow leaves it
    Effect("cooler_flap_stalls_in_warm_oil", "torque", "oil_temperature_gain", "oil_temperature", "ratio", "1", 0.12,
           lambda s, c: 1 + s * (1.4 * stalled(c - 41, 10, 46) - 0.6)),
)
