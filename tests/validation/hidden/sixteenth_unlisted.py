"""Effects in pairs that a catalogue would not list, for the list `polar`; part of `SIXTEENTH` (sixteenth.py)."""

from .effect import Effect
from .sixteenth_shapes import absorber, bond, echoes, fins, overtones, recoil, rough, slits, winds

SIXTEENTH_UNLISTED = (
    # Grooves of the piston rod pass a port of the line, three of them at a time
    Effect("grooves_of_the_piston_pass_a_port_of_the_line", "pressure", "pressure_gain", "piston", "ratio", "1", 0.06,
           lambda s, x: 1 - s * (1.5 * slits(x - 0.0014, 0.0013, 3) - 0.4)),
    # The iron of the output, rough at all scales, passes the armature of the valve
    Effect("armature_feels_the_iron_of_the_output", "pressure", "valve_delay", "output_position", "ratio", "1", 0.25,
           lambda s, x: 1 + s * (1.5 * rough(x + 0.4, 5.5) - 0.6)),
    # The carrier of the plates passes three whirls between two speeds of the output
    Effect("plate_carrier_whirls_between_two_speeds", "torque", "clearance", "output_speed", "ratio", "1", 0.12,
           lambda s, w: 1 + s * winds(w, 13, 9, 2.5)),
    # A lubrication tank on the input is filled after the command, is emptied, and filled again
    Effect("tank_on_the_input_is_filled_and_emptied", "input speed", "input_drag", "time", "difference", "N m", 10.0,
           lambda s, t: s * (1.5 * fins(t - 0.06, 0.48, 0.4, 2.5) - 0.4)),
    # The bridge of the torque has an absorber, which rings just above the slip that it is tuned to
    Effect("torque_bridge_absorber_rings_beside_its_slip", "torque", "output_torque_sensor", "slip", "difference",
           "N m", 25.0, lambda s, v: s * 0.9 * absorber(v, 13, 27, 2)),
    # The wheel of the output was ground on a square arbor, and rings at its corners
    Effect("output_wheel_was_ground_on_a_square_arbor", "output speed", "output_speed_sensor", "output_position",
           "difference", "rad/s", 1.5, lambda s, x: s * (0.9 * overtones(x - 0.3, 6.2) + 0.1)),
    # The pack holds back the oil of the converter until the piston has moved, and takes a part of it as it closes
    Effect("converter_oil_is_held_back_by_the_pack", "input speed", "converter_torque", "piston", "ratio", "1", 0.08,
           lambda s, x: 1 - s * (1.1 * bond(x, 0.0011, 0.0011) - 0.4)),
    # The hot plates let off puffs of vapour at the port of the sensor, ever weaker
    Effect("pressure_port_feels_puffs_of_vapour", "pressure", "pressure_sensor", "heat", "difference", "bar", 0.35,
           lambda s, h: s * (1.4 * echoes(h, 700, 1100, 0.75, 320) - 0.3)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("plate_teeth_mesh_at_some_temperatures", "torque", "contact_pressure", "oil_temperature", "ratio", "1", 0.12,
           lambda s, c: 1 + s * (1.5 * slits(c - 61, 21, 3) - 0.5)),
    Effect("output_pickup_holder_wanders_in_its_seat", "output speed", "output_speed_sensor", "oil_temperature",
           "difference", "rad/s", 1.5, lambda s, c: s * winds(c, 63, 11, 2.5)),
    Effect("relief_spring_gives_way_and_sets", "pressure", "pressure_gain", "oil_temperature", "ratio", "1", 0.06,
           lambda s, c: 1 + s * (1.2 * recoil(c, 52, 6) - 0.3)),
)
