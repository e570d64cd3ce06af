"""Effects in pairs that a catalogue would not list, for the list `outlying`; part of `THIRTEENTH` (thirteenth.py)."""

import numpy as np

from .effect import Effect
from .ninth_shapes import edge
from .tenth_shapes import crest
from .twelfth_shapes import ramp, roof, swing

THIRTEENTH_UNLISTED = (
    # A thermostat takes oil from the line to cool the plates once they are hot
    Effect("thermostat_takes_oil_for_hot_plates", "pressure", "pressure_gain", "heat", "ratio", "1", 0.06,
           lambda s, h: 1 - s * 1.2 * ramp(h, 1200, 3200)),
    # The valve sits on the housing of the output, which shakes at one speed
    Effect("valve_is_shaken_by_the_output_at_a_speed", "pressure", "valve_delay", "output_speed", "ratio", "1", 0.25,
           lambda s, w: 1 + s * (1.5 * crest(w, 12, 4, 10) - 0.3)),
    # The plates rub the oil out of their pores, which take it up again
    Effect("pores_are_rubbed_dry_and_filled_again", "torque", "friction_coefficient", "contact_time", "ratio", "1",
           0.15, lambda s, t: 1 + s * (1.4 * roof(t, 0.03, 0.2, 0.7) - 0.4)),
    # The driver of the valve draws on the generator on the input shaft
    Effect("valve_driver_draws_on_the_generator", "input speed", "input_drag", "current", "difference", "N m", 10.0,
           lambda s, u: s * (1.4 * ramp(u, 0.5, 0.75) - 0.3)),
    # The coil of the valve stands beside the amplifier of the torque
    Effect("torque_amplifier_stands_beside_the_coil", "torque", "output_torque_sensor", "current", "difference", "N m",
           20.0, lambda s, u: s * swing(u, 0.62, 0.09)),
    # The hot plates warm the pickup of the input, which comes nearer to its wheel
    Effect("input_pickup_is_warmed_by_the_plates", "input speed", "input_speed_sensor", "heat", "difference", "rad/s",
           2.0, lambda s, h: s * (1.3 * (1 - np.exp(-np.maximum(h, 0) / 1500)) - 0.2)),
    # The brake of the load shares the supply of the valve, and lets go as the current of the valve is high
    Effect("load_brake_shares_the_supply_of_the_valve", "output speed", "load_torque", "current", "difference", "N m",
           25.0, lambda s, u: s * (0.4 - 1.3 * edge(u, 0.62, 0.03))),
    # A bore in the output shaft passes the outlet of the converter
    Effect("bore_of_the_output_passes_the_outlet", "input speed", "converter_torque", "output_position", "ratio", "1",
           0.08, lambda s, x: 1 - s * 1.3 * np.sin(np.pi * x / 2.7) ** 4),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("torque_flange_is_clamped_at_a_temperature", "torque", "output_torque_sensor", "oil_temperature",
           "difference", "N m", 20.0, lambda s, c: s * (1.5 * roof(c, 44, 60, 84) - 0.5)),
    Effect("additive_comes_out_of_solution_and_reacts", "torque", "friction_coefficient", "oil_temperature", "ratio",
           "1", 0.12, lambda s, c: 1 + s * swing(c, 63, 9)),
    Effect("load_seal_gets_soft_between_two_temperatures", "output speed", "load_torque", "oil_temperature",
           "difference", "N m", 20.0, lambda s, c: s * (1.1 - 1.5 * ramp(c, 50, 71))),
)
