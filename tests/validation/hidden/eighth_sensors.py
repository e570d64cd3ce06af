"""Lags, offsets and gain errors of sensors of the list `beyond`; part of `EIGHTH` (eighth.py)."""

import numpy as np
from scipy.special import sici

from .unseen_sensors import gain, lag, offset

EIGHTH_SENSORS = (
    lag("pressure_hose_is_flat_until_it_is_filled", "pressure", "collapse", 0.02),
    lag("torque_amplifier_is_tuned_for_another_cable", "output_torque", "lead", 0.004),
    offset("pressure_zero_jumps_ever_more_often", "pressure", "sequence", 0.25,
           lambda r: 0.3 + np.floor(5 * np.clip(r, 0, 1) ** 2.2) / 4),
    offset("output_speed_plug_is_open_once_per_turn", "output_speed", "time", 0.6,
           lambda t: 0.25 + 1.1 * (np.mod(t / 0.31, 1.0) < 0.35)),
    offset("torque_zero_is_knocked_and_settles", "output_torque", "sequence", 15.0,
           lambda r: 0.6 + 0.45 * sici(30 * (r - 0.45))[0]),
    gain("pressure_digits_fold", "pressure", 0.06, lambda x: np.abs(np.mod(2.7 * x + 0.5, 1.0) - 0.5)),
    gain("torque_gauge_peels_off", "output_torque", 0.06, lambda x: 1.4 * x * np.log(np.abs(x) / 0.4 + 0.02)),
)
