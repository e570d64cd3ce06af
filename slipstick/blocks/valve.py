"""The valve: the current determines the pressure, by the first two lines of eq. 1.

    x1'' = -6/tau^2 x1 - 4/tau x1' + 6 k/tau^2 (u - a) - 2 k/tau u',   x1(0) = x1'(0) = 0

On a straight piece of the current, of slope s, the pressure is the ramp k (u - a) - k tau s and a decaying oscillation
with the rates (-2 +- i sqrt(2))/tau. The pieces are joined at the breakpoints, so the prediction has no step size.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from slipstick.bench import Conditions, parameters
from slipstick.blocks.block import signals_of
from slipstick.recordings import Recordings

_DELAY, _BIAS, _GAIN = (parameters.index(name) for name in ("current_delay", "current_bias", "current_gain"))
DECAY, FREQUENCY = 2.0, float(np.sqrt(2.0))
"""Of the oscillation, in units of 1/tau: roots of r^2 + 4 r + 6."""
_SAME_STEP = 1e-9
"""Relative difference up to which a step between samples is the usual one, but for rounding."""


@dataclass(frozen=True, eq=False)
class Valve:
    """Pressure in bar at `time` (k,) in s, from the current profiles of n `conditions`."""

    conditions: Conditions
    time: np.ndarray
    output: str = "pressure"
    parameters: tuple[str, ...] = ("current_delay", "current_bias", "current_gain")

    @classmethod
    def of(cls, recordings: Recordings) -> "Valve":
        """The valve of recordings; raises `BadRecording` where they have no signals."""
        return cls(recordings.conditions, signals_of(recordings).time)

    def predict(self, vectors: np.ndarray) -> np.ndarray:
        """Pressure (n, k) in bar."""
        delay, bias, gain = (np.ascontiguousarray(vectors[:, column]) for column in (_DELAY, _BIAS, _GAIN))
        profile = self.conditions.current_profile
        predicted = np.zeros((len(vectors), len(self.time)))
        _respond(self.conditions.profile_time, self.conditions.profile_current, profile.astype(np.int64), delay, bias,
                 gain, self.time, predicted)
        return predicted


@njit(nogil=True, cache=True, error_model="numpy")
def _respond(times, currents, profile, delay, bias, gain, time, predicted):  # type: ignore[no-untyped-def]
    """Fill `predicted` (n, k) from the first breakpoint on; the last current goes on beyond its breakpoint."""
    last, step = times.shape[1] - 1, time[1] - time[0]
    for i in range(len(predicted)):
        at, current, tau = times[profile[i]], currents[profile[i]], delay[i]
        pressure, rate = 0.0, 0.0
        turn_c, turn_s = wave(step / tau)
        t = np.searchsorted(time, at[0])
        for piece in range(last + 1):
            slope = (current[piece + 1] - current[piece]) / (at[piece + 1] - at[piece]) if piece < last else 0.0
            ramp = gain[i] * slope
            offset = gain[i] * (current[piece] - bias[i]) - tau * ramp
            # In units of tau: y = e^(-2 t) (p cos + q sin), from y(0) and y'(0) at the start of the piece.
            cosine = pressure - offset
            sine = ((rate - ramp) * tau + DECAY * cosine) / FREQUENCY
            first = t
            c, s = 0.0, 0.0
            while t < len(time) and (piece == last or time[t] < at[piece + 1]):
                since = time[t] - at[piece]
                # From sample to sample the wave is turned, which takes a tenth of the time of its functions.
                if t > first and abs(time[t] - time[t - 1] - step) < _SAME_STEP * step:
                    c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
                else:
                    c, s = wave(since / tau)
                predicted[i, t] = offset + ramp * since + cosine * c + sine * s
                t += 1
            if piece < last:
                length = at[piece + 1] - at[piece]
                c, s = wave(length / tau)
                value = cosine * c + sine * s
                pressure = offset + ramp * length + value
                rate = ramp + (FREQUENCY * (sine * c - cosine * s) - DECAY * value) / tau


@njit(nogil=True, cache=True, error_model="numpy")
def wave(elapsed):  # type: ignore[no-untyped-def]
    """The decaying cosine and sine at a time `elapsed` in units of tau."""
    decay = np.exp(-DECAY * elapsed)
    return decay * np.cos(FREQUENCY * elapsed), decay * np.sin(FREQUENCY * elapsed)
