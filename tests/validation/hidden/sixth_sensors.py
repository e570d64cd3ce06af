"""Lags, offsets and gain errors of sensors of the list `later`; part of `SIXTH` (sixth.py)."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import erf, j0, j1

from .unseen_sensors import gain, lag, offset

WHEEL = CubicSpline([0, 0.28, 0.45, 0.62, 0.8, 1.1], [0, 0.5, -0.3, 0.6, -0.5, 0.3])

SIXTH_SENSORS = (
    lag("pressure_gauge_has_play", "pressure", "friction", 0.012),
    lag("input_speed_filter_is_switched_over", "input_speed", "switch", 0.03),
    lag("output_speed_bus_is_held_up_by_turns", "output_speed", "turns", 0.02),
    lag("load_cell_sends_on_a_change", "output_torque", "changes", 0.012),
    offset("pressure_zero_follows_the_hall", "pressure", "sequence", 0.25,
           lambda r: 0.25 + 1.2 * np.abs(np.sin(2.5 * np.pi * r))),
    offset("input_speed_zero_rings_down", "input_speed", "time", 1.5, lambda t: 0.4 + 1.1 * j0(9 * t)),
    offset("output_speed_zero_grows_and_stays", "output_speed", "sequence", 0.6,
           lambda r: 0.1 + 1.2 * np.exp(-6 * np.exp(-7 * r))),
    offset("torque_zero_hangs_like_a_chain", "output_torque", "sequence", 15.0,
           lambda r: 1.7 - 0.5 * np.cosh(2.7 * (r - 0.45))),
    gain("pressure_membrane_meets_its_stop", "pressure", 0.06, lambda x: 0.5 * erf(3.2 * x)),
    gain("input_speed_wheel_was_cut_unevenly", "input_speed", 0.03, WHEEL),
    gain("output_speed_scale_ripples_off", "output_speed", 0.05, lambda x: j1(6 * x)),
    gain("torque_bridge_buckles", "output_torque", 0.06,
         lambda x: np.sign(x) * (0.5 * (np.minimum(np.abs(x), 0.22) / 0.22) ** 0.5
                                 - 0.9 * np.maximum(np.abs(x) - 0.22, 0) ** 1.4)),
)
