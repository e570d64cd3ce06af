"""Processing of sampled signals before they are compared: block means, and blending at lock-up."""

import numpy as np


def blended_at_lock_up(torque: np.ndarray, shifting_time: np.ndarray, time: np.ndarray) -> np.ndarray:
    """`torque` (m, n, k), with the sample nearest to each lock-up (m, n) replaced by a weighted mean of its neighbours.

    The torque jumps at lock-up. With this blending, averages over samples are continuous in the shifting time, so
    that finite differences between two simulations approximate derivatives.
    """
    torque = torque.copy()
    locked = np.argwhere((shifting_time > time[1]) & (shifting_time < time[-2]))
    row, column = locked[:, 0], locked[:, 1]
    lock_up = shifting_time[row, column]
    midpoints = 0.5 * (time[1:] + time[:-1])
    nearest = np.clip(np.searchsorted(midpoints, lock_up), 1, len(time) - 2)
    weight = (lock_up - midpoints[nearest - 1]) / (midpoints[nearest] - midpoints[nearest - 1])
    before, after = torque[row, column, nearest - 1], torque[row, column, nearest + 1]
    torque[row, column, nearest] = weight * before + (1 - weight) * after
    return torque


def block_means(samples: np.ndarray, width: int) -> np.ndarray:
    """Means of blocks of `width` successive samples, shape (..., k // width); an incomplete last block is dropped."""
    used = samples.shape[-1] // width * width
    return np.asarray(samples[..., :used].reshape(*samples.shape[:-1], -1, width).mean(axis=-1))
