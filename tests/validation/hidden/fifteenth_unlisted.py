"""Effects in pairs that a catalogue would not list, for the list `overseas`; part of `FIFTEENTH` (fifteenth.py)."""

from .effect import Effect
from .fifteenth_shapes import beat, bounces, cusps, dome, fringes, lull, packet, saddle, spike

FIFTEENTH_UNLISTED = (
    # A bore of the output shaft lets oil out of the line once in a turn
    Effect("bore_of_the_output_empties_the_line", "pressure", "pressure_gain", "output_position", "ratio", "1", 0.06,
           lambda s, x: 1 - s * (1.5 * cusps(x - 1.6, 5.2) - 0.4)),
    # The housing of the valve is jolted as the plates bite, and its spool is caught for a moment
    Effect("spool_is_caught_as_the_plates_bite", "pressure", "valve_delay", "contact_time", "ratio", "1", 0.25,
           lambda s, t: 1 + s * (1.5 * spike(t, 0.12, 0.25, 0.4) - 0.3)),
    # The plates bulge in two ways, with waves of different length over the heat
    Effect("hot_plates_bulge_in_two_ways", "torque", "contact_pressure", "heat", "ratio", "1", 0.12,
           lambda s, h: 1 + s * 0.9 * beat(h - 300, 2600, 1500)),
    # A pump on the input is driven by the output through a belt that flutters
    Effect("input_pump_hangs_on_a_fluttering_belt", "input speed", "input_drag", "output_speed", "difference", "N m",
           10.0, lambda s, w: s * 1.2 * packet(w, 14, 9, 7)),
    # The cable of the torque runs over the piston, and is pinched at two strokes
    Effect("torque_cable_is_pinched_at_two_strokes", "torque", "output_torque_sensor", "piston", "difference", "N m",
           25.0, lambda s, x: s * (1.4 * saddle(x, 0.0012, 0.0005) - 0.4)),
    # The pickup of the output is knocked as the plates bite, and bounces
    Effect("output_pickup_bounces_after_the_bite", "output speed", "output_speed_sensor", "contact_time", "difference",
           "rad/s", 1.5, lambda s, t: s * (1.4 * bounces(t, 0.02, 0.24, 0.7) - 0.3)),
    # The charge line swings after the command, ever more slowly
    Effect("charge_line_swings_ever_more_slowly", "input speed", "converter_torque", "time", "ratio", "1", 0.08,
           lambda s, t: 1 - s * 0.9 * fringes(t, 0.6, 0.25)),
    # The oil of the drum leaves the plates below a speed and comes back above it
    Effect("drum_oil_leaves_the_plates_and_comes_back", "torque", "friction_coefficient", "input_speed", "ratio", "1",
           0.12, lambda s, w: 1 + s * lull(w, 95, 38)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("spool_expands_between_two_temperatures", "pressure", "valve_delay", "oil_temperature", "ratio", "1", 0.25,
           lambda s, c: 1 + s * (1.4 * dome(c, 50, 77) - 0.4)),
    Effect("two_polymers_uncoil_in_the_oil", "torque", "film_coefficient", "oil_temperature", "ratio", "1", 1.2,
           lambda s, c: (1 + s) ** (0.6 * beat(c - 58, 34, 21))),
    Effect("load_gear_is_even_between_two_temperatures", "output speed", "load_torque", "oil_temperature", "difference",
           "N m", 20.0, lambda s, c: s * lull(c, 63, 10)),
)
