"""Effects in pairs that a catalogue would not list, for the list `boreal`; part of `EIGHTEENTH` (eighteenth.py)."""


from .effect import Effect
from .eighteenth_shapes import (
    captured,
    hunting,
    missing,
    overdue,
    rubbed,
    unlocked,
    widening,
    worn,
    yields,
)

EIGHTEENTH_UNLISTED = (
    # The supply of the sensor begins to hunt as the plates bite, ever more
    Effect("pressure_supply_hunts_as_the_plates_bite", "pressure", "pressure_sensor", "contact_time", "difference",
           "bar", 0.35, lambda s, t: s * (0.2 + 0.9 * hunting(t, 0.06, 0.24, 0.5))),
    # The dither of the spool is locked to the pulses of the pump about a speed, and slips through them beside
    Effect("spool_locks_to_the_pulses_of_the_pump", "pressure", "valve_delay", "motor_speed", "ratio", "1", 0.25,
           lambda s, w: 1 + s * unlocked(w, 150, 18)),
    # A shuttle at the chamber swings after the command, and sticks by friction
    Effect("shuttle_of_the_chamber_swings_and_sticks", "torque", "chamber_pressure", "time", "difference", "bar", 0.6,
           lambda s, t: s * (rubbed(t, 0.1, 0.26, 0.11) - 0.7)),
    # The cable of the input pickup lies beside that of the valve, whose pulses become wider with the current
    Effect("input_pickup_hears_the_pulses_of_the_valve", "input speed", "input_speed_sensor", "current", "difference",
           "rad/s", 2.0, lambda s, u: s * (1.4 * widening(u, 0.24, 0.8, 3) - 0.5)),
    # The carrier of the telemetry is captured by the hum of the output between two speeds
    Effect("telemetry_is_captured_by_the_hum_of_the_output", "torque", "output_torque_sensor", "output_speed",
           "difference", "N m", 25.0, lambda s, w: s * 1.1 * captured(w, 7, 29, 1.2)),
    # The pickup of the output is bent by the piston until its bracket yields, and hardens
    Effect("output_pickup_bracket_yields_to_the_piston", "output speed", "output_speed_sensor", "piston", "difference",
           "rad/s", 1.5, lambda s, x: s * (1.4 * yields(x, 0.0009, 0.0019, 0.0008) - 0.3)),
    # The rings of the rotary union are worn at both ends of the pressures over which they were run in
    Effect("union_rings_are_worn_at_two_pressures", "input speed", "input_drag", "pressure", "difference", "N m", 10.0,
           lambda s, p: s * (0.5 - 1.5 * worn(p, 3, 9.5))),
    # Marks of the output pass the cable of the sensor, evenly but for one
    Effect("pressure_cable_hears_marks_of_the_output", "pressure", "pressure_sensor", "output_position", "difference",
           "bar", 0.35, lambda s, x: s * (1.4 * missing(x, 2.9, 3) - 0.4)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("wax_in_the_oil_melts_late", "torque", "oil_temperature_gain", "oil_temperature", "ratio", "1", 0.12,
           lambda s, c: 1 + s * (overdue(c - 38, 12, 22, 36) - 1.2)),
    Effect("pressure_glue_is_captured_between_two_temperatures", "pressure", "pressure_sensor", "oil_temperature",
           "difference", "bar", 0.3, lambda s, c: s * 1.1 * captured(c, 51, 76, 1.5)),
    Effect("charge_thermostat_is_locked_about_a_temperature", "input speed", "converter_torque", "oil_temperature",
           "ratio", "1", 0.06, lambda s, c: 1 - s * unlocked(c, 63, 6)),
)
