"""Effects in pairs that a catalogue would not list, for the list `farther`; part of `ELEVENTH` (eleventh.py)."""

from .effect import Effect
from .eleventh_shapes import comb
from .fifth import passage
from .ninth_shapes import edge, hump
from .tenth_shapes import crest, shelf, warmed

ELEVENTH_UNLISTED = (
    # The valve and the pressure sensor share a return wire, whose contact gives way from a current on
    Effect("pressure_sensor_shares_a_wire_with_the_valve", "pressure", "pressure_sensor", "current", "difference",
           "bar", 0.3, lambda s, u: s * (1.2 * edge(u, 0.43, 0.04) - 0.2)),
    # Warm oil from the line reaches the chamber a while after the command
    Effect("warm_oil_reaches_the_chamber", "torque", "oil_temperature_gain", "time", "ratio", "1", 0.1,
           lambda s, t: 1 + s * (1.3 * hump(t, 0.24, 1.6) - 0.3)),
    # A leak of the chamber opens as the plates bite, and is closed as the housing follows
    Effect("chamber_leaks_as_the_plates_bite", "torque", "chamber_pressure", "contact_time", "difference", "bar", 0.6,
           lambda s, t: -s * 1.3 * warmed(t, 0.03, 0.28, 0.06, 0.25)),
    # The supply of the brake is short of oil while the plates bite
    Effect("brake_is_short_of_oil_as_the_plates_bite", "output speed", "load_torque", "contact_time", "difference",
           "N m", 25.0, lambda s, t: s * (0.3 - 1.3 * hump(t, 0.12, 1.5))),
    # The plates throw foam on the outlet of the converter above a slip
    Effect("foam_from_the_plates_blocks_the_converter", "input speed", "converter_torque", "slip", "ratio", "1", 0.08,
           lambda s, v: 1 - s * 1.2 * edge(v, 19, 2)),
    # A key on the output rubs on the input shaft once in a turn of the gear
    Effect("key_rubs_once_per_turn", "input speed", "input_drag", "output_position", "difference", "N m", 10.0,
           lambda s, x: s * (1.5 * comb(x, 2.6, 6) - 0.3)),
    # The antenna of the telemetry shakes at one speed of the motor
    Effect("torque_telemetry_is_shaken_by_the_motor", "torque", "output_torque_sensor", "motor_speed", "difference",
           "N m", 25.0, lambda s, w: s * (1.5 * crest(w, 162, 20, 14) - 0.5)),
    Effect("output_pickup_is_shaken_by_the_judder", "output speed", "output_speed_sensor", "slip", "difference",
           "rad/s", 1.5, lambda s, v: s * (1.3 * hump(v, 12, 2) - 0.2)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("shaft_seal_grips_at_a_temperature", "input speed", "input_drag", "oil_temperature", "difference", "N m",
           10.0, lambda s, c: s * (1.5 * crest(c, 58, 6, 13) - 0.4)),
    Effect("plates_are_spread_between_two_temperatures", "torque", "clearance", "oil_temperature", "ratio", "1", 0.1,
           lambda s, c: 1 + s * (1.4 * shelf(c, 53, 70, 6) - 0.5)),
    Effect("chamber_seal_turns_over_at_a_temperature", "torque", "chamber_pressure", "oil_temperature", "difference",
           "bar", 0.5, lambda s, c: s * 0.9 * passage(c, 62, 6)),
)
