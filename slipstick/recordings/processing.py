"""What is computed from sampled signals before they are compared: block means, lock-up blending, sensor noise."""

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.recordings.signals import SIGNAL_UNITS, Signals


def blended_at_lock_up(torque: np.ndarray, shifting_time: np.ndarray, time: np.ndarray) -> np.ndarray:
    """`torque` (m, n, k) with the sample nearest to each lock-up (m, n) blended from its two neighbours.

    At lock-up the torque jumps. The blend makes its average a continuous function of the shifting time, without
    which differences between two simulations say nothing about slopes.
    """
    torque = torque.copy()
    locked = np.argwhere((shifting_time > time[1]) & (shifting_time < time[-2]))
    row, column = locked[:, 0], locked[:, 1]
    when = shifting_time[row, column]
    edges = 0.5 * (time[1:] + time[:-1])
    nearest = np.clip(np.searchsorted(edges, when), 1, len(time) - 2)
    share = (when - edges[nearest - 1]) / (edges[nearest] - edges[nearest - 1])
    before, after = torque[row, column, nearest - 1], torque[row, column, nearest + 1]
    torque[row, column, nearest] = share * before + (1 - share) * after
    return torque


def block_means(samples: np.ndarray, width: int) -> np.ndarray:
    """Means of `width` successive samples, shape (..., k // width)."""
    whole = samples.shape[-1] // width * width
    return np.asarray(samples[..., :whole].reshape(*samples.shape[:-1], -1, width).mean(axis=-1))


def sensor_noise(signals: Signals) -> dict[str, float]:
    """Standard deviation of the noise of each signal, in its unit; raises `InvalidValue` where one has no noise."""
    return {name: noise_std(name, getattr(signals, name).astype(float)) for name in SIGNAL_UNITS}


def noise_std(name: str, values: np.ndarray) -> float:
    """Standard deviation of the noise of rows (n, k): median third difference, which a smooth signal does not reach.

    `name` is that of the signal, for the error: raises `InvalidValue` where there is no noise.
    """
    third = (1, -3, 3, -1)
    rough = np.abs(np.apply_along_axis(np.convolve, 1, values, third, "valid"))
    deviation = float(np.median(rough) / 0.6745 / np.sqrt(sum(c * c for c in third)))
    if not deviation > 0:
        raise InvalidValue(f"The signal {name} shows no noise, so nothing says how much it counts",
                           "Record it with a finer resolution, or add the noise of its sensor")
    return deviation
