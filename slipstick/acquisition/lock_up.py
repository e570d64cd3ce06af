"""The shifting time from the speeds: where the slip reaches zero, located between samples, with its error.

About lock-up the slip, input speed - gear ratio * output speed, is fitted by a curve with a corner:

    slip(t) = offset + slope * (lock - t) + bend * (lock - t)^2   before lock,   offset   after it.

The offset allows for errors of the gear ratio and the sensors. The corner is found by least squares over its place, all
else being linear.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from slipstick.numerics.deviations import from_median

LOCKED = 0.05
"""Share of the largest slip under which the plates are taken to stick, for a first estimate."""
_WINDOW = 0.15
"""Share of the largest slip from which on it is fitted. The torque of the shipped recordings jumps at lock-up as well:
on the heavy bench the corner is 0.9 ms late with a quarter, where the slip is no parabola, and 0.2 ms with this."""
_LEAST = 6
"""Samples on either side that a fit needs: it has four unknowns."""
_BEYOND = 3.0
"""Standard deviations beyond which recorded shifting times and speeds are not on one clock."""


@dataclass(frozen=True)
class LockUp:
    """A shifting time and its standard error in s, and the `slope` (rad/s^2) with which the slip reaches zero."""

    time: float
    error: float
    slope: float


def lock_up(time: np.ndarray, slip: np.ndarray) -> LockUp | None:
    """Lock-up from the slip (k,) in rad/s at `time` (k,) s from the shift command; None where it is not reached."""
    time, slip = time[time >= 0], slip[time >= 0]
    if len(time) < 2 * _LEAST or not np.all(np.isfinite(slip)):
        return None
    largest = float(slip.max())
    slipping = np.flatnonzero(slip > LOCKED * largest)
    if largest <= 0 or slipping[-1] + 1 + _LEAST > len(time):
        return None
    last = int(slipping[-1])
    earlier = np.flatnonzero(slip[:last] > _WINDOW * largest)
    if not len(earlier):
        return None
    first = min(int(earlier[-1]), last - _LEAST)
    end = min(len(time), last + max(_LEAST, last - first) + 1)
    if first < 0:
        return None
    time, slip = time[first:end], slip[first:end]
    width = float(time[last - first] - time[0])
    bounds = time[2], min(time[last - first] + width, time[-3])

    def misfit(lock: float) -> float:
        return float(np.sum((slip - _columns(time, lock) @ _coefficients(time, slip, lock)) ** 2))

    grid = np.linspace(*bounds, 4 * len(time))  # the misfit may have minima beside the deepest one
    start = grid[int(np.argmin([misfit(lock) for lock in grid]))]
    around = 2 * (grid[1] - grid[0])
    near = max(bounds[0], start - around), min(bounds[1], start + around)
    lock = float(scipy.optimize.minimize_scalar(misfit, bounds=near, method="bounded", options={"xatol": 1e-7}).x)
    _, slope, bend = _coefficients(time, slip, lock)
    if not slope > 0:
        return None
    ahead = np.maximum(lock - time, 0.0)
    moved = np.where(time < lock, slope + 2 * bend * ahead, 0.0)
    jacobian = np.column_stack([_columns(time, lock), moved])
    variance = misfit(lock) / max(1, len(time) - 4)
    error = float(np.sqrt(variance * np.linalg.pinv(jacobian.T @ jacobian)[3, 3]))
    return LockUp(lock, error, float(slope))


def lateness(located: np.ndarray, recorded: np.ndarray, step: float) -> float:
    """By how many s the speeds meet after the recorded shifting time in the median, 0 where noise may be the reason.

    `located` (n,) are the shifting times by the speeds in s, NaN where these show none. Clocks of sensors are known to
    one `step` in s, and a difference to a step or to how far differences spread.
    """
    late = (located - recorded)[np.isfinite(located)]
    if not len(late):
        return 0.0
    median, spread = float(np.median(late)), max(float(from_median(late)[1]), step)
    return median if abs(median) > _BEYOND * np.hypot(step, spread * np.sqrt(np.pi / 2 / len(late))) else 0.0


def _columns(time: np.ndarray, lock: float) -> np.ndarray:
    ahead = np.maximum(lock - time, 0.0)
    return np.column_stack([np.ones_like(time), ahead, ahead**2])


def _coefficients(time: np.ndarray, slip: np.ndarray, lock: float) -> np.ndarray:
    return np.asarray(np.linalg.lstsq(_columns(time, lock), slip, rcond=None)[0])
