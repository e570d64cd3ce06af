"""Responses to sampled columns: of a first-order equation, and of the valve; and the smoother of a random walk."""

import numpy as np
from numba import njit

from slipstick.blocks.valve import DECAY, FREQUENCY, wave

_SERIES = 1e-6
"""Product of rate and step below which the weight is taken from its Taylor series, because the closed form cancels."""

_SLOWER = 1e-5
"""Relative step of the derivative of a step of the valve with respect to its delay."""
_LEAST_RATIO = 1e-9
"""Least variance of a step of a random walk over that of the white noise: without steps the average has no end."""


def first_order(time: np.ndarray, forcing: np.ndarray, rate: np.ndarray, alive: np.ndarray | None = None) -> np.ndarray:
    """x (n, p, k) of x' = forcing - rate x from x(0) = 0, for forcing (n, p, k) and rate (n, k - 1) in 1/s.

    `time` (k,) is in s, the forcing in the unit of x per s. Each step is exact for a rate and a forcing that are
    constant over it, the forcing at the mean of its ends. Where the forcing changes linearly, a step of length h is off
    by rate h^2 / 12 times that change, to leading order. Where `alive` (n, k - 1) is false x is 0: a shaft at
    rest does not know what moved it before.
    """
    steps = np.diff(time)
    y = rate * steps
    decay = np.exp(-y)
    small = np.abs(y) <= _SERIES
    weight = np.where(small, 1 - y / 2, (1 - decay) / np.where(small, 1.0, y)) * steps
    if alive is not None:
        decay, weight = decay * alive, weight * alive
    out = np.zeros(forcing.shape)
    _first_order(np.ascontiguousarray(forcing), decay, weight, out)
    return out


@njit(nogil=True, cache=True)
def _first_order(forcing, decay, weight, out):  # type: ignore[no-untyped-def]
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            x = 0.0
            for t in range(out.shape[2] - 1):
                x = decay[i, t] * x + 0.5 * weight[i, t] * (forcing[i, j, t] + forcing[i, j, t + 1])
                out[i, j, t + 1] = x


def valve_response(step: float, demand: np.ndarray, delay: np.ndarray) -> np.ndarray:
    """Pressure (n, p, k) at steps of `step` s for a demanded pressure (n, p, k) and the delays tau (n,) in s.

    The valve delays the demand by tau, in the second-order Pade approximation of eq. 1, from rest at pressure 0:

        x'' = -6/tau^2 x - 4/tau x' + 6/tau^2 demand - 2/tau demand'

    It is exact for a demand that is linear between samples. A first demand other than 0 acts from the
    start, without the impulse that a jump of the demand would give its derivative.
    """
    out = np.zeros(demand.shape)
    _second_order(np.ascontiguousarray(demand), step / delay, out)
    return out


@njit(nogil=True, cache=True)
def _second_order(demand, steps, out):  # type: ignore[no-untyped-def]
    for i in range(out.shape[0]):
        turn = wave(steps[i])
        # A step is linear in pressure, rate and the demands at both ends. Four columns at a time, none of which waits
        # for another one, take a quarter to a half of the time.
        xx, vx = _advanced(1.0, 0.0, steps[i], turn, 0.0, 0.0)
        xv, vv = _advanced(0.0, 1.0, steps[i], turn, 0.0, 0.0)
        xn, vn = _advanced(0.0, 0.0, steps[i], turn, 1.0, 0.0)
        xl, vl = _advanced(0.0, 0.0, steps[i], turn, 0.0, 1.0)
        m = out.shape[1]
        for j in range(0, m, 4):
            a, b, c, d = j, min(j + 1, m - 1), min(j + 2, m - 1), min(j + 3, m - 1)
            x0 = x1 = x2 = x3 = v0 = v1 = v2 = v3 = 0.0
            n0, n1, n2, n3 = demand[i, a, 0], demand[i, b, 0], demand[i, c, 0], demand[i, d, 0]
            for t in range(1, out.shape[2]):
                l0, l1, l2, l3 = demand[i, a, t], demand[i, b, t], demand[i, c, t], demand[i, d, t]
                x0, v0 = xx * x0 + xv * v0 + xn * n0 + xl * l0, vx * x0 + vv * v0 + vn * n0 + vl * l0
                x1, v1 = xx * x1 + xv * v1 + xn * n1 + xl * l1, vx * x1 + vv * v1 + vn * n1 + vl * l1
                x2, v2 = xx * x2 + xv * v2 + xn * n2 + xl * l2, vx * x2 + vv * v2 + vn * n2 + vl * l2
                x3, v3 = xx * x3 + xv * v3 + xn * n3 + xl * l3, vx * x3 + vv * v3 + vn * n3 + vl * l3
                n0, n1, n2, n3 = l0, l1, l2, l3
                out[i, a, t], out[i, b, t], out[i, c, t], out[i, d, t] = x0, x1, x2, x3


@njit(nogil=True, cache=True)
def _advanced(x, v, h, turn, now, later):  # type: ignore[no-untyped-def]
    # Time in units of tau: a ramp of the demand is followed one unit late.
    c, s = turn
    ramp = (later - now) / h
    offset = now - ramp
    # Deviation from the ramp's own response: exp(-2 h) (a cos + b sin).
    a = x - offset
    b = ((v - ramp) + DECAY * a) / FREQUENCY
    value = a * c + b * s
    return offset + ramp * h + value, ramp - DECAY * value + FREQUENCY * (b * c - a * s)


def varying_response(step: float, demand: np.ndarray, delay: np.ndarray,
                     changes: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Pressure (n, k) as `valve_response`, for a demand (n, k) and delays (n, k) in s that change with time.

    And its derivatives (n, m, k) with respect to relative `changes` (n, m, k) of the delay, by default none. The delay
    is constant over each step, with the mean of its ends. Pressure and rate do not jump with it.
    """
    changes = np.zeros((len(demand), 0, demand.shape[1])) if changes is None else np.ascontiguousarray(changes)
    out, columns = np.zeros(demand.shape), np.zeros(changes.shape)
    _varying(np.ascontiguousarray(demand), 2 * step / (delay[:, 1:] + delay[:, :-1]), changes, out, columns)
    return out, columns


@njit(nogil=True, cache=True)
def _varying(demand, steps, changes, out, columns):  # type: ignore[no-untyped-def]
    m = changes.shape[1]
    for i in range(out.shape[0]):
        x, v = 0.0, 0.0
        moved_x, moved_v = np.zeros(m), np.zeros(m)
        for t in range(out.shape[1] - 1):
            h, now, later = steps[i, t], demand[i, t], demand[i, t + 1]
            if t > 0:  # rates are in units of tau
                v *= steps[i, t - 1] / h
                moved_v *= steps[i, t - 1] / h
            turn = wave(h)
            ahead_x, ahead_v = _advanced(x, v, h, turn, now, later)
            if m:
                # The step is linear in pressure and rate. With a longer delay it is shorter, and its rate larger.
                xx, vx = _advanced(1.0, 0.0, h, turn, 0.0, 0.0)
                xv, vv = _advanced(0.0, 1.0, h, turn, 0.0, 0.0)
                shorter = h / (1 + _SLOWER)
                slow_x, slow_v = _advanced(x, v * (1 + _SLOWER), shorter, wave(shorter), now, later)
                dx, dv = (slow_x - ahead_x) / _SLOWER, (slow_v / (1 + _SLOWER) - ahead_v) / _SLOWER
                for j in range(m):
                    change = 0.5 * (changes[i, j, t] + changes[i, j, t + 1])
                    a, b = moved_x[j], moved_v[j]
                    moved_x[j] = xx * a + xv * b + dx * change
                    moved_v[j] = vx * a + vv * b + dv * change
                    columns[i, j, t + 1] = moved_x[j]
            x, v = ahead_x, ahead_v
            out[i, t + 1] = x


def smoothed_walk(residual: np.ndarray, ratio: np.ndarray) -> np.ndarray:
    """The random walk in residuals (n, k) of a random walk and white noise, in their unit.

    `ratio` (n,) is the variance of a step of the walk over that of the white noise. The steady Kalman smoother of this
    system is a two-sided exponential average, with a weight that falls by w per sample, w + 1/w = 2 + ratio. Its error
    is uncorrelated with the residuals, so that what is computed from the estimated walk can be compared with them. That
    holds away from the ends: there the average is over the samples that remain, which the smoother weighs otherwise.
    """
    half = 1 + 0.5 * np.maximum(ratio, _LEAST_RATIO)
    weight = half - np.sqrt(half**2 - 1)
    forward = _exponential(residual, weight)
    backward = _exponential(residual[:, ::-1], weight)[:, ::-1]
    w = weight[:, None]
    count = (1 - w ** np.arange(1, residual.shape[1] + 1)) / (1 - w)
    return np.asarray((forward + backward - residual) / (count + count[:, ::-1] - 1))


def _exponential(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Sums (n, k) of the values (n, k) so far, each with a weight that falls by `weight` (n,) per sample."""
    out = np.empty(values.shape)
    _accumulate(np.ascontiguousarray(values), weight, out)
    return out


@njit(nogil=True, cache=True)
def _accumulate(values, weight, out):  # type: ignore[no-untyped-def]
    for i in range(len(values)):
        state = 0.0
        for t in range(values.shape[1]):
            state = weight[i] * state + values[i, t]
            out[i, t] = state
