"""Lags, offsets and gain errors of sensors of the list `further`; part of `SEVENTH` (seventh.py)."""

import numpy as np

from .unseen_sensors import gain, lag, offset


def langevin(x: np.ndarray) -> np.ndarray:
    """Return the magnetization of a paramagnet, from -1 to 1."""
    away = np.where(np.abs(x) < 1e-3, 1.0, x)
    return np.where(np.abs(x) < 1e-3, x / 3, 1 / np.tanh(away) - 1 / away)


SEVENTH_SENSORS = (
    lag("input_speed_pickup_shakes_in_a_band", "input_speed", "band", 0.02),
    lag("torque_frame_answers_late", "output_torque", "echo", 0.018),
    lag("output_speed_filter_adapts", "output_speed", "adapt", 0.03),
    lag("pressure_port_is_full_of_sludge", "pressure", "sludge", 0.012),
    offset("pressure_plug_is_loose", "pressure", "sequence", 0.25,
           lambda r: np.where(np.sin(17 * r) + np.sin(29 * r) > 0.3, 1.4, 0.5)),
    offset("input_speed_zero_hums_in_beats", "input_speed", "time", 1.5,
           lambda t: 0.5 + 0.9 * np.cos(2 * np.pi * t / 0.23) * np.cos(2 * np.pi * t / 1.3)),
    offset("output_speed_zero_is_a_bathtub", "output_speed", "sequence", 0.6,
           lambda r: 0.2 + 1.1 * np.exp(-r / 0.08) + np.clip(r, 0, 1) ** 8),
    offset("torque_slip_ring_wears", "output_torque", "sequence", 15.0,
           lambda r: 1.5 - 1.5 * np.sqrt(np.abs(r - 0.4) / 0.6)),
    gain("pressure_membrane_is_dented", "pressure", 0.06, lambda x: 2 * x * np.exp(-((x / 0.45) ** 2))),
    gain("input_speed_counter_has_a_stuck_bit", "input_speed", 0.03, lambda x: -0.5 * (np.floor(4.6 * x) % 2)),
    gain("output_speed_belt_creeps", "output_speed", 0.05, lambda x: np.expm1(np.minimum(5 * x, 8)) / 60),
    gain("torque_shaft_is_magnetized", "output_torque", 0.06, lambda x: 0.35 * langevin(x / 0.05)),
)
