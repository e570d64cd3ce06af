"""Effects in pairs that a catalogue would not list, for the list `austral`; part of `SEVENTEENTH` (seventeenth.py)."""

import numpy as np

from .effect import Effect
from .seventeenth_shapes import closing, foam, grip, isolated, moody, notch, rebound, tunnel, wells

SEVENTEENTH_UNLISTED = (
    # The controller of the pump overcorrects as the clutch is filled
    Effect("pump_controller_overcorrects_after_the_command", "pressure", "pressure_gain", "time", "ratio", "1", 0.06,
           lambda s, t: 1 + s * 1.2 * rebound(t, 0.12, 0.06, 0.22, 0.7)),
    # The oil that the piston draws rocks the spool at a stroke, and passes it by at a longer one
    Effect("spool_rocks_in_the_oil_that_the_piston_draws", "pressure", "valve_delay", "piston", "ratio", "1", 0.25,
           lambda s, x: 1 + s * (1.5 * isolated(x, 0.0013, 0.2) - 0.4)),
    # The plates are wedged as they bite, slide into place, and are wedged again as they settle
    Effect("plates_are_wedged_as_they_bite_and_settle", "torque", "contact_pressure", "contact_time", "ratio", "1",
           0.12, lambda s, t: 1 - s * (1.4 * tunnel(t, 0.09, 0.75) - 0.5)),
    # The hot plates press on a ring of the input, which yields like a foam
    Effect("hot_plates_press_on_a_ring_of_the_input", "input speed", "input_drag", "heat", "difference", "N m", 10.0,
           lambda s, h: s * (1.5 * foam(np.maximum(h, 0), 600, 4200) - 0.3)),
    # The hose of the clutch straightens at a pressure, and pulls at the bracket of the torque's sensor
    Effect("hose_of_the_clutch_pulls_at_the_torque_sensor", "torque", "output_torque_sensor", "pressure", "difference",
           "N m", 25.0, lambda s, p: s * (1.5 * grip(p, 3.4, 1.85) - 0.5)),
    # The pickup of the output hears the input, except at two speeds at which its yoke rests
    Effect("output_pickup_hears_the_input", "output speed", "output_speed_sensor", "input_speed", "difference", "rad/s",
           1.5, lambda s, w: s * (wells(w, 100, 42) - 0.4)),
    # The converter is relieved by a tuned pipe at a pressure of the clutch
    Effect("converter_is_relieved_by_a_tuned_pipe", "input speed", "converter_torque", "pressure", "ratio", "1", 0.08,
           lambda s, p: 1 - s * (1.4 * notch(np.maximum(p, 0), 5.5, 3) - 0.5)),
    # The port of the sensor is closed by the piston, and is drawn on once they touch
    Effect("pressure_port_is_closed_by_the_piston", "pressure", "pressure_sensor", "piston", "difference", "bar", 0.35,
           lambda s, x: s * (1.5 * closing(x, 0.0016, 0.0003, 0.0003) - 0.4)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("lining_glue_closes_its_pores_at_a_temperature", "torque", "friction_coefficient", "oil_temperature",
           "ratio", "1", 0.12, lambda s, c: 1 + s * (1.5 * closing(c, 66, 5, 6) - 0.5)),
    Effect("valve_spring_is_right_at_two_temperatures", "pressure", "valve_current", "oil_temperature", "difference",
           "A", 0.015, lambda s, c: s * (wells(c, 63, 11) - 0.5)),
    Effect("oil_in_the_bearing_of_the_input_turns_turbulent", "input speed", "input_drag", "oil_temperature",
           "difference", "N m", 10.0, lambda s, c: s * (1.6 * moody(c - 38, 24, 1.2) - 0.6)),
)
