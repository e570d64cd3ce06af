"""Effects in pairs that a catalogue would not list, for the list `alpine`; part of `NINETEENTH` (nineteenth.py).

The comment of each one says why a bench could show it. No earlier list has six of the pairs, which are those of the
first six effects.
"""

import numpy as np

from .effect import Effect
from .nineteenth_shapes import (
    avalanches,
    bores,
    condensing,
    folded,
    holed,
    leaning,
    meshing,
    plucked,
    shadow,
    swell,
    vernier,
)

NINETEENTH_UNLISTED = (
    # Valve current over time: other valves on the same supply are switched one after another from the command on, and
    # its voltage rings each time
    Effect("valve_supply_rings_as_other_valves_are_switched", "pressure", "valve_current", "time", "difference", "A",
           0.02, lambda s, t: s * 1.1 * plucked(t - 0.04, 0.34, 2, 0.17)),
    # Piston rate over input speed: the oil comes through a bore of the rotating input shaft, in which it swings
    Effect("oil_swings_in_the_bore_of_the_input", "torque", "piston_rate", "input_speed", "ratio", "1", 0.4,
           lambda s, w: (1 + s) ** (0.6 - 1.5 * leaning(w, 70, 55, 9, 2.5))),
    # Input speed sensor over output position: the teeth of a gear on the output pass its pickup, which is beside them
    Effect("input_pickup_sees_the_gear_of_the_output", "input speed", "input_speed_sensor", "output_position",
           "difference", "rad/s", 2.0, lambda s, x: s * (1.4 * meshing(x, 2.4, 0.4) - 0.5)),
    # Output speed sensor over motor speed: the inverter of the motor is heard by its cable, and its pulses and those of
    # the motor are folded into the band of the counter
    Effect("output_counter_folds_the_pulses_of_the_inverter", "output speed", "output_speed_sensor", "motor_speed",
           "difference", "rad/s", 1.5, lambda s, w: s * (0.2 + folded(w - 150, 190, 0.55))),
    # Clearance over output position: the carrier of the plates is on the output, and does not run true
    Effect("plate_carrier_does_not_run_true", "torque", "clearance", "output_position", "ratio", "1", 0.12,
           lambda s, x: 1 - s * swell(x - 0.9, 3.4, 0.75)),
    # Valve current over input speed: the valve is on the housing of the input shaft, whose vibrations loosen its
    # armature at all speeds of a range but the one at which both swing together
    Effect("armature_is_loosened_by_the_input_but_at_a_speed", "pressure", "valve_current", "input_speed", "difference",
           "A", 0.02, lambda s, w: s * (1.5 * holed(w, 105, 70, 12) - 0.5)),
    # Friction over the time in contact: the oil leaves the plates in patches, after each of which others flow together
    Effect("oil_leaves_the_plates_in_uneven_patches", "torque", "friction_coefficient", "contact_time", "ratio", "1",
           0.12, lambda s, t: 1 + s * (1.4 * avalanches(np.minimum(t, 1), 4, 0.02, (0.12, 0.35), (0.27, 0.6),
                                                        (0.41, 0.4), (0.6, 1.1), (0.82, 0.9)) - 0.5)),
    # Load torque over the output position: two rollers of different size, each out of round, run on the drum
    Effect("two_rollers_of_the_drum_press_together", "output speed", "load_torque", "output_position", "difference",
           "N m", 30.0, lambda s, x: s * (1.5 * vernier(x - 1.5, 2.9, 2.1) - 0.4)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    # Torque sensor: bores of its amplifier's case, which expands with the oil, pass two windows of the cooling air
    Effect("torque_amplifier_windows_are_passed_as_it_warms", "torque", "output_torque_sensor", "oil_temperature",
           "difference", "N m", 25.0, lambda s, c: s * (1.4 * bores(c, (53, 5, 4), (71, 6, 6)) - 0.5)),
    # Film: fuel that got into the oil evaporates and condenses; viscosities differ by a power
    Effect("fuel_in_the_oil_evaporates_and_condenses", "torque", "film_coefficient", "oil_temperature", "ratio", "1",
           1.2, lambda s, c: (1 + s) ** (0.9 * condensing(c, 46, 16))),
    # Valve delay: the spring of the pilot expands past an edge, at which its flow swings
    Effect("pilot_spring_expands_past_an_edge", "pressure", "valve_delay", "oil_temperature", "ratio", "1", 0.25,
           lambda s, c: 1 + s * (1.1 * shadow(c, 54, 9) - 0.7)),
)
