"""The torque converter of eq. 3: torque ratio f_st and capacity factor f_sk against the speed ratio.

Both are linear between the points and constant outside. The manufacturer's curves in the paper are unpublished; these
are plausible curves of this project.
"""

import numpy as np

SPEED_RATIO = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95, 1.0)
TORQUE_RATIO = (2.2, 2.06, 1.91, 1.77, 1.62, 1.48, 1.34, 1.21, 1.08, 1.01, 1.0, 0.99, 0.98)
CAPACITY_FACTOR = (12.0, 12.0, 12.1, 12.2, 12.4, 12.7, 13.2, 14.1, 15.6, 17.0, 20.0, 28.0, 90.0)
"""Capacity factor in rad/s per sqrt(N m)."""


def torque(input_speed: float, motor_speed: float) -> float:
    """Output torque in N m at `input_speed` and `motor_speed` in rad/s: motor_speed^2 f_st / f_sk^2."""
    ratio = input_speed / motor_speed
    torque_ratio = float(np.interp(ratio, SPEED_RATIO, TORQUE_RATIO))
    capacity = float(np.interp(ratio, SPEED_RATIO, CAPACITY_FACTOR))
    return motor_speed**2 * torque_ratio / capacity**2


def spec() -> dict[str, list[float]]:
    """The curves as JSON, part of the spec of every model."""
    return {
        "speed_ratio": list(SPEED_RATIO),
        "torque_ratio": list(TORQUE_RATIO),
        "capacity_factor": list(CAPACITY_FACTOR),
    }


def segments() -> np.ndarray:
    ratio, torque_ratio, capacity = (np.array(curve) for curve in (SPEED_RATIO, TORQUE_RATIO, CAPACITY_FACTOR))
    rises = np.diff(torque_ratio) / np.diff(ratio), np.diff(capacity) / np.diff(ratio)
    bends = np.column_stack([ratio[1:-1], *(np.diff(rise) for rise in rises)])
    bends = np.concatenate([bends, np.zeros((-len(bends) % 4, 3))])
    return np.concatenate([[len(bends) // 4, ratio[0], ratio[-1], torque_ratio[0], capacity[0], rises[0][0], rises[1][0]],
                           bends.ravel()])
