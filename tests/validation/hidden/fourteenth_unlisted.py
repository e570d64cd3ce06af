"""Effects in pairs that a catalogue would not list, for the list `distant`; part of `FOURTEENTH` (fourteenth.py)."""

import numpy as np

from .effect import Effect
from .eleventh_shapes import comb
from .ninth_shapes import burr
from .tenth_shapes import shelf
from .thirteenth_shapes import treads
from .twelfth_shapes import ramp, roof, swing, trough

FOURTEENTH_UNLISTED = (
    # A scavenge pump on the input shaft draws air into the sump most at one speed
    Effect("scavenge_pump_of_the_input_foams_the_sump", "pressure", "pressure_gain", "input_speed", "ratio", "1", 0.06,
           lambda s, w: 1 - s * (1.5 * roof(w, 50, 110, 160) - 0.4)),
    # The hot plates draw the bore of the valve tight
    Effect("valve_bore_is_drawn_tight_by_the_heat", "pressure", "valve_delay", "heat", "ratio", "1", 0.25,
           lambda s, h: 1 + s * (1.4 * ramp(h, 500, 2400) - 0.2)),
    # The rear of the piston is full of oil at first, which pushes back until it has drained
    Effect("oil_behind_the_piston_drains_after_the_command", "torque", "contact_pressure", "time", "ratio", "1", 0.12,
           lambda s, t: 1 - s * (1.3 * np.exp(-((np.maximum(t, 0) / 0.5) ** 3)) - 0.2)),
    # A thrust washer of the input is loaded as the piston comes
    Effect("thrust_washer_is_loaded_by_the_piston", "input speed", "input_drag", "piston", "difference", "N m", 10.0,
           lambda s, x: s * (1.4 * ramp(x, 0.0011, 0.0022) - 0.4)),
    # A slip ring of the torque sensor has a worn spot
    Effect("slip_ring_of_the_torque_has_a_worn_spot", "torque", "output_torque_sensor", "output_position", "difference",
           "N m", 25.0, lambda s, x: s * (1.4 * comb(x - 1.2, 3.3, 9) - 0.3)),
    # The cable of the output pickup lies beside that of the valve, whose driver changes its mode at a current
    Effect("output_pickup_cable_lies_beside_the_valve_driver", "output speed", "output_speed_sensor", "current",
           "difference", "rad/s", 1.5, lambda s, u: s * (1.4 * burr(u, 0.42, 0.02, 0.3) - 0.3)),
    # The valve of the converter shares its supply with that of the clutch, and drops in between
    Effect("converter_valve_shares_the_supply_of_the_clutch_valve", "input speed", "converter_torque", "current",
           "ratio", "1", 0.08, lambda s, u: 1 - s * (1.4 * shelf(u, 0.36, 0.62, 0.1) - 0.4)),
    # The carrier of the plates resonates with the output, first against and then with the plates
    Effect("plate_carrier_resonates_with_the_output", "torque", "friction_coefficient", "output_speed", "ratio", "1",
           0.12, lambda s, w: 1 + s * swing(w, 14, 5)),
    # Over the oil temperature, which is then a further channel of the recordings, in degrees Celsius
    Effect("pressure_sensor_gel_sets_in_two_stages", "pressure", "pressure_sensor", "oil_temperature", "difference",
           "bar", 0.3, lambda s, c: s * (treads(c, (46, 51, 0.8), (70, 76, 0.8)) - 0.6)),
    Effect("valve_driver_has_a_fan_between_two_temperatures", "pressure", "valve_current", "oil_temperature",
           "difference", "A", 0.015, lambda s, c: s * (1.5 * shelf(c, 52, 73, 8) - 0.6)),
    Effect("converter_charge_is_right_between_two_temperatures", "input speed", "converter_torque", "oil_temperature",
           "ratio", "1", 0.06, lambda s, c: 1 - s * (trough(np.clip(c, 30, 95), 57, 67, 14) - 0.5)),
)
