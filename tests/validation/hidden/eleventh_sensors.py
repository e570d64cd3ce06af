"""Lags, offsets and gain errors of sensors of the list `farther`; part of `ELEVENTH` (eleventh.py)."""

import numpy as np

from .eleventh_shapes import arch, comb, tared
from .fifth import passage
from .ninth_shapes import hump
from .tenth_shapes import scallops
from .unseen_sensors import gain, lag, offset

ELEVENTH_SENSORS = (
    # The pressure runs to and fro in a long hose with the sensor at its dead end
    lag("pressure_hose_hammers", "pressure", "hammer", 0.004),
    # The time of a group of pulses is taken; fast ones are divided by 16 before
    lag("output_pulses_are_timed_in_groups", "output_speed", "divide", 0.012),
    # The diaphragm was overloaded, and creeps back
    offset("pressure_diaphragm_recovers_from_an_overload", "pressure", "sequence", 0.3,
           lambda r: 0.2 + 1.3 * hump(r, 0.2, 1.5)),
    # The relay of a fan sends a pulse into the cable whenever it switches
    offset("input_speed_cable_picks_up_a_relay", "input_speed", "time", 2.5, lambda t: 0.15 + 1.4 * comb(t, 0.44, 9)),
    # The bridge creeps, and is set to zero now and then
    offset("torque_bridge_is_set_to_zero_now_and_then", "output_torque", "sequence", 15.0,
           lambda r: 0.2 + 1.2 * tared(r + 0.12, 0.39)),
    # The membrane snaps through
    gain("pressure_membrane_snaps_through", "pressure", 0.06,
         lambda x: 0.45 * (passage(x, 0.42, 0.14) - passage(0.0, 0.42, 0.14))),
    # The counter has three ranges, and reads high in the middle of each
    gain("output_speed_counter_has_ranges", "output_speed", 0.06, lambda x: 0.6 * scallops(x, 0.31)),
    # A guard against overload carries its part between two torques, and yields
    gain("torque_shaft_has_a_guard_that_yields", "output_torque", 0.06,
         lambda x: -0.5 * np.sign(x) * arch(np.abs(x), 0.06, 0.5)),
)
