"""The lag of the converter: a mixture of four first-order lags of its torque, which may change over slip and runs."""

import numpy as np

from slipstick.naming.bases import gain_points
from slipstick.naming.lags import lags_about, late_by, mixed, modulated
from slipstick.naming.law_map import LawMap, single
from slipstick.naming.scene import Scene
from slipstick.naming.sensor_lags import lag_scale, sizes_over_runs
from slipstick.numerics.piecewise import hats

_SCALE = 2.0
"""Time scale of the lags, relative to that of lags of sensors."""


def lag_columns(scene: Scene, torque: np.ndarray, finer: int) -> np.ndarray:
    """Changes (n, m, k) in N m of the `torque` (n, k) of the converter by the lags; more of them where `finer`."""
    late = late_by(torque, scene.time, lag_unit(scene))
    return np.concatenate([modulated(late, sizes) for sizes in _sizes(scene, finer)], axis=1) if finer else late


def lagging(scene: Scene, torque: np.ndarray, c: np.ndarray, finer: int) -> np.ndarray:
    """The change (n, k) in N m of the `torque` (n, k) with coefficients `c` of the `lag_columns`."""
    weights = c[None, :, None]
    if finer:
        over_time, over_runs = _sizes(scene, finer)
        of_time, of_runs = np.split(c.reshape(-1, len(lags_about(lag_unit(scene)))), [over_time.shape[1]])
        weights = np.einsum("nmk,ml->nlk", over_time, of_time, optimize=True)
        weights += np.einsum("nmk,ml->nlk", over_runs, of_runs)
    return mixed(torque, scene.time, lag_unit(scene), weights)


def mean_lag(scene: Scene, finer: int) -> LawMap:
    """The lag in s: the mean of the impulse response, and over time while the plates slip."""
    times = lags_about(lag_unit(scene))
    if not finer:
        return single(times, "s")
    over_time, over_runs = _sizes(scene, finer)
    mean = over_time.transpose(0, 2, 1)[scene.slipping].mean(axis=0)
    return single(np.outer(np.pad(mean, (0, over_runs.shape[1])), times).ravel(), "s")


def lag_unit(scene: Scene) -> float:
    """Time scale of the lags in s."""
    return _SCALE * lag_scale(scene)


def _sizes(scene: Scene, finer: int) -> tuple[np.ndarray, np.ndarray]:
    """Sizes of a `finer` lag, over the time of slip (n, m, k) and over the run order (n, l, 1)."""
    knots = scene.recordings.measured_time.max() * gain_points(finer)
    return hats(scene.abscissa("time"), knots), sizes_over_runs(scene, finer)
