"""Lags of sensors: mixtures of four first-order lags, which may change with the signal, the time and the run order."""

import numpy as np

from slipstick.naming.bases import between, gain_points, hats
from slipstick.naming.lags import dead_times, lag_points, lags_about, late_by, mixed, modulated
from slipstick.naming.scene import Scene


def lag_scale(scene: Scene) -> float:
    """Time scale in s of the lags of sensors."""
    return float(scene.value("current_delay"))


def sizes_over_runs(scene: Scene, finer: int) -> np.ndarray:
    """Sizes (n, m, 1) of a `finer` lag that changes over the run order, of mean 0 over the runs."""
    return between(scene.run, len(gain_points(finer)))[:, :, None]


def late_columns(scene: Scene, signal: np.ndarray, largest: float, finer: int) -> np.ndarray:
    """Errors (n, m, k) of a sensor that lags behind a `signal` (n, k), in its unit.

    They are those of four first-order lags. Where `finer`, they are those of four dead times, and of the four lags over
    the signal, which has a `largest` size, over the time, and over the run order.
    """
    late = late_by(signal, scene.time, lag_scale(scene))
    if not finer:
        return late
    delays = np.stack(dead_times(signal, scene.time, lag_scale(scene)), axis=1)
    over_signal = hats(np.abs(signal) / largest, lag_points(finer))
    over_time = hats(scene.abscissa("time"), _times(scene, finer))[:, 1:]
    sizes = over_signal, over_time, sizes_over_runs(scene, finer)
    return np.concatenate([delays, *(modulated(late, its) for its in sizes)], axis=1)


def read_late(scene: Scene, signal: np.ndarray, largest: float, c: np.ndarray, finer: int) -> np.ndarray:
    """The error (n, k) with coefficients `c` of the `late_columns`, without these: a block has very many of them."""
    time, scale = scene.time, lag_scale(scene)
    if not finer:
        return mixed(signal, time, scale, c[None, :, None])
    points, times = lag_points(finer), _times(scene, finer)
    of_each_lag = c.reshape(-1, len(lags_about(scale)))
    dead, over_signal, over_time, over_runs = np.split(of_each_lag, np.cumsum([1, len(points), len(times) - 1]))
    share = np.abs(signal) / largest
    weights = np.stack([np.interp(share, points, at_signal) + np.interp(time, times, [0.0, *at_time])
                        for at_signal, at_time in zip(over_signal.T, over_time.T, strict=True)], axis=1)
    weights += np.einsum("nm,ml->nl", sizes_over_runs(scene, finer)[:, :, 0], over_runs)[:, :, None]
    delayed = [weight * its for weight, its in zip(dead[0], dead_times(signal, time, scale), strict=True)]
    return np.asarray(mixed(signal, time, scale, weights) + np.sum(delayed, axis=0))


def _times(scene: Scene, finer: int) -> np.ndarray:
    """Points in s of a `finer` lag over the time in a recording."""
    return np.asarray(scene.time[-1] * lag_points(finer))
