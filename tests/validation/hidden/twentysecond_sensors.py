"""Lags, offsets and gain errors of sensors of the list `solar`; part of `TWENTYSECOND` (twentysecond.py)."""

import numpy as np

from .twentysecond_shapes import duckbill, pulse, released, struck, toggled, twin
from .unseen_sensors import gain, lag, offset

TWENTYSECOND_SENSORS = (
    # A ball in the sensor's line lets a rise pass nearly at once, and a fall only through a leak of constant flow
    lag("pressure_line_bleeds_through_a_leak", "pressure", "bleeds", 0.012),
    # Pulses of the output wait in a queue once they come faster than they are handled, until it is full and thrown away
    lag("output_speed_pulses_wait_in_a_queue", "output_speed", "queues", 0.02),
    # The clamp of the sensor creeps, is struck by a tool, and is drawn askew from then on
    offset("pressure_clamp_is_struck_and_drawn_askew", "pressure", "sequence", 0.3,
           lambda r: 1.3 * struck(r, 0, 1) - 0.2),
    # The supply is coupled by a capacitor, which passes on how the ventilator of the rig is switched on and off
    offset("input_speed_supply_passes_on_a_ventilator", "input_speed", "time", 2.5,
           lambda t: 1.1 * pulse(t, -0.05, 2.6)),
    # The cable of the bridge is drawn by a hose that sags ever more, until it is tied up, and then by the next one
    offset("torque_cable_is_drawn_by_a_sagging_hose", "output_torque", "sequence", 18.0,
           lambda r: 1.2 * released(r, 0, 1) - 0.2),
    # Two corrugations of the membrane bulge, one within a narrow range of pressures
    gain("pressure_membrane_bulges_at_two_corrugations", "pressure", 0.06, lambda x: 0.6 * (twin(x, 0.02, 0.82) - 0.2)),
    # The trigger of the pickup counts burrs at rest, above a speed, hardly where it is set anew, and by and by again
    gain("output_speed_pickup_counts_burrs", "output_speed", 0.07, lambda x: 0.5 * (duckbill(x, 0.0, 1.05) - 0.45)),
    # A dished washer in the hub turns over by the torque, and lies on its stop
    gain("torque_hub_washer_turns_over", "output_torque", 0.06,
         lambda x: -0.5 * np.sign(x) * toggled(np.abs(x), 0.0, 0.95)),
)
