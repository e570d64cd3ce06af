"""Lags of sensors: mixtures of four first-order lags, which may change with the signal, the time and the run order."""

from dataclasses import dataclass

import numpy as np

from slipstick.naming.bases import between, gain_points
from slipstick.naming.lags import add_dead_times, dead_times, lag_points, lags_about, late_by, mixed, modulated
from slipstick.naming.scene import Scene
from slipstick.numerics.piecewise import hats, slope


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
    changing = (modulated(late, sizes) for sizes in (over_signal, over_time, sizes_over_runs(scene, finer)))
    return np.concatenate([delays, *changing], axis=1)


def read_late(scene: Scene, signal: np.ndarray, largest: float, c: np.ndarray, finer: int) -> np.ndarray:
    """The error (n, k) with coefficients `c` of the `late_columns`, without these: a block has very many of them."""
    time, scale = scene.time, lag_scale(scene)
    if not finer:
        return mixed(signal, time, scale, c[None, :, None])
    sizes = _Sizes.of(scene, c, finer)
    error = mixed(signal, time, scale, sizes.at(np.abs(signal) / largest))
    add_dead_times(error, signal, time, scale, sizes.dead)
    return error


def change_read_late(scene: Scene, signal: np.ndarray, largest: float, c: np.ndarray, finer: int,
                     change: np.ndarray) -> np.ndarray:
    """Changes (n, m, k) of that error with those of the signal, `change` (n, m, k): its derivative along them."""
    time, scale, rows = scene.time, lag_scale(scene), change.reshape(-1, change.shape[-1])
    if not finer:
        return mixed(rows, time, scale, c[None, :, None]).reshape(change.shape)
    sizes, share = _Sizes.of(scene, c, finer), np.abs(signal) / largest
    of_error = mixed(rows, time, scale, sizes.at(share))
    add_dead_times(of_error, rows, time, scale, sizes.dead)
    steeper = (sizes.slopes(share) * late_by(signal, time, scale)).sum(axis=1) * np.sign(signal) / largest
    return np.asarray(of_error.reshape(change.shape) + steeper[:, None] * change)


@dataclass(frozen=True, eq=False)
class _Sizes:
    """Sizes of the lags (4,) of a `finer` lag: of `dead` times, and of first-order ones, (m, 4) each, at `points`.

    The latter are over the share of the largest signal, (4, k) over the time, and (n, 4) over the run order.
    """

    points: np.ndarray
    dead: np.ndarray
    over_signal: np.ndarray
    over_time: np.ndarray
    over_runs: np.ndarray

    @classmethod
    def of(cls, scene: Scene, c: np.ndarray, finer: int) -> "_Sizes":
        """From coefficients `c` of the `late_columns`."""
        points = lag_points(finer)
        dead, signal, time, runs = np.split(c.reshape(-1, len(lags_about(lag_scale(scene)))),
                                            np.cumsum([1, len(points), len(points) - 1]))
        over_time = np.array([np.interp(scene.time, _times(scene, finer), [0.0, *sizes]) for sizes in time.T])
        return cls(points, dead[0], signal, over_time, sizes_over_runs(scene, finer)[:, :, 0] @ runs)

    def at(self, share: np.ndarray) -> np.ndarray:
        """Weights (n, 4, k) of the first-order lags at shares (n, k) of the largest signal."""
        over_signal = np.stack([np.interp(share, self.points, sizes) for sizes in self.over_signal.T], axis=1)
        return np.asarray(over_signal + self.over_time + self.over_runs[:, :, None])

    def slopes(self, share: np.ndarray) -> np.ndarray:
        """Slopes (n, 4, k) of the weights over the share (n, k)."""
        return np.stack([slope(share, self.points, sizes) for sizes in self.over_signal.T], axis=1)


def _times(scene: Scene, finer: int) -> np.ndarray:
    """Points in s of a `finer` lag over the time in a recording."""
    return np.asarray(scene.time[-1] * lag_points(finer))
