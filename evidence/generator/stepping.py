"""Dormand-Prince 5(4) for many lanes, each with its own time and adaptive step, with location of phase changes.

The phase of a lane (piece of the current, mode, sign of the slip) is constant within a step. A step beyond the end of
its phase is repeated with a length from the secant rule, until it ends less than `NEAR` seconds after the change.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.integrate import RK45  # only its tableau is used

NEAR = 1e-7  # s, tolerance of the location of phase changes
SHORTEST = 1e-6  # s, minimum length of a step that neither ends at a knot nor locates a change
ROUNDS = 20_000  # maximum number of steps, rejected ones included


class System(Protocol):
    """Right-hand side for n lanes: states (states, n), phases (3, n), and tolerances (states, 1)."""

    tolerance: np.ndarray

    def rates(self, time: np.ndarray, state: np.ndarray, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rates (states, n) and the margin (n,), which is negative after the end of the phase."""

    def limit(self, phase: np.ndarray) -> np.ndarray:
        """Return the time (n,) at which steps in this phase must end."""

    def advance(self, phase: np.ndarray, lanes: np.ndarray) -> None:
        """Change the phases of `lanes` to those after this time."""

    def switch(self, time: np.ndarray, state: np.ndarray, phase: np.ndarray, lanes: np.ndarray) -> None:
        """Change phases and states of `lanes`, whose margin has become negative."""


@dataclass(frozen=True)
class Solution:
    """The steps of all lanes: start and length (rounds, n), phase and polynomial; rejected steps have length 0."""

    start: np.ndarray
    length: np.ndarray
    phase: np.ndarray
    initial: np.ndarray
    slopes: np.ndarray

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return states (states, n, k) and phases (3, n, k) at the ascending `times` (k,)."""
        states, phases = [], []
        for lane in range(self.start.shape[1]):
            accepted = np.flatnonzero(self.length[:, lane])
            step = accepted[np.maximum(np.searchsorted(self.start[accepted, lane], times, side="right") - 1, 0)]
            length = self.length[step, lane]
            powers = np.power.outer((times - self.start[step, lane]) / length, np.arange(1, 5)) * length[:, None]
            states.append(self.initial[step, :, lane] + np.einsum("kso,ko->ks", self.slopes[step, :, :, lane], powers))
            phases.append(self.phase[step, :, lane])
        return np.array(states).transpose(2, 0, 1), np.array(phases).transpose(2, 0, 1)


def integrate(system: System, state: np.ndarray, phase: np.ndarray, end: float, relative: float = 1e-8) -> Solution:
    """Integrate from time 0 to `end`; raises `RuntimeError` if a lane does not reach it within `ROUNDS` steps."""
    time, step = np.zeros(state.shape[1]), np.full(state.shape[1], 1e-4)
    rounds = []
    for _ in range(ROUNDS):
        if np.all(time >= end):
            return Solution(*(np.array(column) for column in zip(*rounds, strict=True)))
        limit = np.minimum(system.limit(phase), end)
        length = np.minimum(step, limit - time)
        to_limit = step >= limit - time
        k, new, before, after = _stages(system, time, state, phase, length)
        scale = system.tolerance + relative * np.maximum(np.abs(state), np.abs(new))
        error = np.max(np.abs(length * _combine(RK45.E, k) / scale), axis=0) + 1e-10
        crossing = after < 0
        fraction = np.maximum(before, 0) / (np.maximum(before, 0) - np.where(crossing, after, -1))
        change = crossing & ((1 - fraction) * length <= NEAR)
        accepted = (error <= 1) & (change | ~crossing) & (length > 0)
        slopes = np.tensordot(RK45.P.T, k, 1).swapaxes(0, 1)
        rounds.append((time, np.where(accepted, length, 0), phase.copy(), state, slopes))
        time = np.where(accepted, np.where(to_limit, limit, time + length), time)
        state = np.where(accepted, new, state)
        step = np.maximum(length * np.clip(0.9 * error**-0.2, 0.2, 5), SHORTEST)
        step = np.where(crossing & (error <= 1) & ~change, fraction * length + NEAR / 2, step)
        system.advance(phase, np.flatnonzero(accepted & to_limit & (time < end)))
        system.switch(time, state, phase, np.flatnonzero(change & accepted))
    raise RuntimeError(f"Engagements {np.flatnonzero(time < end)} did not get beyond {time[time < end]} s")


def _stages(system: System, time: np.ndarray, state: np.ndarray, phase: np.ndarray, length: np.ndarray) -> tuple:
    first, before = system.rates(time, state, phase)
    k = np.empty((7, *state.shape))
    k[0] = first
    for stage in range(1, 6):
        stage_state = state + length * _combine(RK45.A[stage, :stage], k[:stage])
        k[stage], _ = system.rates(time + RK45.C[stage] * length, stage_state, phase)
    new = state + length * _combine(RK45.B, k[:6])
    k[6], after = system.rates(time + length, new, phase)
    return k, new, before, after


def _combine(weights: np.ndarray, k: np.ndarray) -> np.ndarray:
    """Return the sum of `k` (m, states, n) with `weights` (m,): as `np.tensordot` does, in a third of its time."""
    return (weights[None] @ k.reshape(len(k), -1)).reshape(k.shape[1:])
