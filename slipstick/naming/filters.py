"""Responses of linear systems to columns of forcing, exact for forcing that is linear between samples."""

import numpy as np
from numba import njit


def first_order(time: np.ndarray, forcing: np.ndarray, rate: np.ndarray, alive: np.ndarray | None = None) -> np.ndarray:
    """x (n, p, k) of x' = forcing - rate x from x(0) = 0, for forcing (n, p, k) and rate (n, k - 1) in 1/s.

    Where `alive` (n, k - 1) is false x keeps its value.
    """
    steps = np.diff(time)
    y = rate * steps
    decay = np.exp(-y)
    weight = np.where(np.abs(y) > 1e-6, (1 - decay) / np.where(np.abs(y) > 1e-6, y, 1.0), 1 - y / 2) * steps
    if alive is not None:
        decay, weight = np.where(alive, decay, 1.0), weight * alive
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

    x'' = -6/tau^2 x - 4/tau x' + 6/tau^2 demand - 2/tau demand', at rest at first.
    """
    out = np.zeros(demand.shape)
    _second_order(np.ascontiguousarray(demand), step / delay, out)
    return out


@njit(nogil=True, cache=True)
def _second_order(demand, steps, out):  # type: ignore[no-untyped-def]
    frequency = np.sqrt(2.0)
    for i in range(out.shape[0]):
        h = steps[i]
        decay, c, s = np.exp(-2.0 * h), np.cos(frequency * h), np.sin(frequency * h)
        for j in range(out.shape[1]):
            x, v = 0.0, 0.0
            for t in range(out.shape[2] - 1):
                ramp = (demand[i, j, t + 1] - demand[i, j, t]) / h
                offset = demand[i, j, t] - ramp
                a = x - offset
                b = ((v - ramp) + 2.0 * a) / frequency
                value = decay * (a * c + b * s)
                x = offset + ramp * h + value
                v = ramp - 2.0 * value + frequency * decay * (b * c - a * s)
                out[i, j, t + 1] = x


def play(values: np.ndarray, width: float) -> np.ndarray:
    """The play operator of half-width `width` along the last axis, starting where the values start."""
    out = np.empty_like(values)
    _play(values.reshape(-1, values.shape[-1]), width, out.reshape(-1, values.shape[-1]))
    return out


@njit(nogil=True, cache=True)
def _play(values, width, out):  # type: ignore[no-untyped-def]
    for i in range(len(values)):
        held = values[i, 0]
        for t in range(values.shape[1]):
            held = min(max(held, values[i, t] - width), values[i, t] + width)
            out[i, t] = held


def smoothed_walk(residual: np.ndarray, ratio: np.ndarray) -> np.ndarray:
    """The random walk in residuals (n, k) of a random walk and white noise, of variances `ratio` (n,) to 1 a step.

    The steady smoother is a two-sided exponential average: its error is uncorrelated with the residuals, so that what is
    computed from it can be compared with them.
    """
    half = 1 + 0.5 * np.maximum(ratio, 1e-9)
    weight = half - np.sqrt(half**2 - 1)
    forward, backward = np.empty_like(residual), np.empty_like(residual)
    _exponential(residual, weight, forward)
    _exponential(residual[:, ::-1], weight, backward)
    backward = backward[:, ::-1]
    w = weight[:, None]
    count = (1 - w ** np.arange(1, residual.shape[1] + 1)) / (1 - w)
    return np.asarray((forward + backward - residual) / (count + count[:, ::-1] - 1))


@njit(nogil=True, cache=True)
def _exponential(values, weight, out):  # type: ignore[no-untyped-def]
    for i in range(len(values)):
        state = 0.0
        for t in range(values.shape[1]):
            state = weight[i] * state + values[i, t]
            out[i, t] = state
