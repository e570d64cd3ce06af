"""Effects in pairs that a catalogue would not list, for the list `solar`; part of `TWENTYSECOND` (twentysecond.py).

The comment of each one says why a bench could show it. No earlier list has six of the pairs, which are those of the
first six effects.
"""

from .effect import Effect
from .twentysecond_shapes import duckbill, nested, posistor, pulse, released, ridden, struck, toggled, twin

TWENTYSECOND_UNLISTED = (
    # Clearance over the current: the coil of the valve, which is beside the drum, pulls two plates of the pack, one of
    # which is soon let go
    Effect("coil_beside_the_drum_pulls_two_plates", "torque", "clearance", "current", "ratio", "1", 0.12,
           lambda s, u: 1 - s * (1.3 * twin(u, 0.22, 0.82) - 0.3)),
    # Film torque over the motor speed: the pump pushes open the lips of a valve of the lubrication, which turn over
    Effect("lubrication_lips_open_and_turn_over_by_the_pump", "torque", "film_coefficient", "motor_speed", "ratio", "1",
           4.0, lambda s, w: (1 + s) ** (0.9 * duckbill(w, 95, 205) - 0.4)),
    # Valve current over output position: the output winds up the wire of the valve, which slips off
    Effect("output_winds_the_valve_wire_over_a_clamp", "pressure", "valve_current", "output_position", "difference",
           "A", 0.02, lambda s, x: s * 1.1 * ridden(x, 0, 11)),
    # Chamber pressure over the motor speed: the pump draws at the drain of the chamber, whose flap turns over
    Effect("drain_flap_turns_over_by_the_pump", "torque", "chamber_pressure", "motor_speed", "difference", "bar", 0.6,
           lambda s, w: s * 1.1 * toggled(w, 95, 205)),
    # Load torque over piston position: the piston pushes the shaft of the load, whose bearing has play
    Effect("piston_pushes_the_load_bearing_through_its_play", "output speed", "load_torque", "piston", "difference",
           "N m", 30.0, lambda s, x: s * (1.3 * struck(x, 0.0003, 0.0022) - 0.2)),
    # Input speed sensor over the time in contact: the bite closes a relay for a while, and a capacitor passes it on
    Effect("input_pickup_hears_a_relay_of_the_bite", "input speed", "input_speed_sensor", "contact_time", "difference",
           "rad/s", 2.0, lambda s, t: s * 1.3 * pulse(t, -0.1, 1.6)),
    # Friction over the run order: the linings become smooth, are sanded, and become smooth again
    Effect("linings_become_smooth_and_are_sanded", "torque", "friction_coefficient", "sequence", "ratio", "1", 0.1,
           lambda s, r: 1 + s * (1.4 * posistor(r, 0, 1) - 0.6)),
    # Input torque over the slip: the slip draws a seal of the input on to its collar, where it springs back
    Effect("input_seal_is_drawn_on_to_its_collar", "input speed", "input_drag", "slip", "difference", "N m", 10.0,
           lambda s, v: s * (1.4 * released(v, 1, 42) - 0.2)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    # Torque sensor: its glue is soft over a broad range of temperatures, in which a filler of it sets
    Effect("torque_glue_is_soft_but_its_filler_sets", "torque", "output_torque_sensor", "oil_temperature", "difference",
           "N m", 25.0, lambda s, c: s * (1.5 * nested(c, 65, 12, 62, 2.2) + 0.2)),
    # Clearance: a bimetal of the retaining ring bends back, snaps out at a temperature, and turns over at a higher one
    Effect("bimetal_of_the_retaining_ring_turns_over", "torque", "clearance", "oil_temperature", "ratio", "1", 0.12,
           lambda s, c: 1 + s * (1.3 * duckbill(c, 40, 90) - 0.5)),
    # Input torque: the input's bearing takes up its play by the heat, is jammed, seats itself, and is drawn tight
    Effect("input_bearing_takes_up_its_play_and_jams", "input speed", "input_drag", "oil_temperature", "difference",
           "N m", 10.0, lambda s, c: s * (1.5 * struck(c, 40, 90) - 0.4)),
)
