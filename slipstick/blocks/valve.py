"""The valve: the current determines the pressure, by the first two lines of eq. 1.

    x1'' = -6/tau^2 x1 - 4/tau x1' + 6 k/tau^2 (u - a) - 2 k/tau u',   x1(0) = x1'(0) = 0

On a straight piece of the current, of slope s, the pressure is the ramp k (u - a) - k tau s and a decaying oscillation
with the rates (-2 +- i sqrt(2))/tau. The pieces are joined at the breakpoints, so the prediction has no step size.
"""

from dataclasses import dataclass

import numpy as np

from slipstick.bench import Conditions, parameters
from slipstick.blocks.block import signals_of
from slipstick.recordings import Recordings

_DELAY, _BIAS, _GAIN = (parameters.index(name) for name in ("current_delay", "current_bias", "current_gain"))
_DECAY, _FREQUENCY = 2.0, np.sqrt(2.0)  # of the oscillation, in units of 1/tau: roots of r^2 + 4 r + 6


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
        delay, bias, gain = (vectors[:, column] for column in (_DELAY, _BIAS, _GAIN))
        profile = self.conditions.current_profile
        times, currents = self.conditions.profile_time[profile], self.conditions.profile_current[profile]
        pressure, rate = np.zeros(len(vectors)), np.zeros(len(vectors))
        predicted = np.zeros((len(vectors), len(self.time)))
        last = times.shape[1] - 1
        for piece in range(last + 1):
            start, current = times[:, piece], currents[:, piece]
            length = times[:, piece + 1] - start if piece < last else np.full(len(start), np.inf)
            slope = (currents[:, piece + 1] - current) / length if piece < last else np.zeros(len(start))
            ramp = gain * slope
            offset = gain * (current - bias) - delay * ramp
            # In units of tau: y = e^(-2 t) (p cos + q sin), from y(0) and y'(0) at the start of the piece.
            cosine = pressure - offset
            sine = ((rate - ramp) * delay + _DECAY * cosine) / _FREQUENCY
            inside = (self.time >= start[:, None]) & (self.time < (start + length)[:, None])
            row, column = np.nonzero(inside)
            since = self.time[column] - start[row]
            predicted[row, column] = (offset[row] + ramp[row] * since
                                      + _oscillation(cosine[row], sine[row], since / delay[row])[0])
            if piece < last:
                value, change = _oscillation(cosine, sine, length / delay)
                pressure, rate = offset + ramp * length + value, ramp + change / delay
        return predicted


def _oscillation(cosine: np.ndarray, sine: np.ndarray, elapsed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The decaying oscillation and its derivative, both in units of tau."""
    decay, c, s = np.exp(-_DECAY * elapsed), np.cos(_FREQUENCY * elapsed), np.sin(_FREQUENCY * elapsed)
    value = decay * (cosine * c + sine * s)
    return value, -_DECAY * value + _FREQUENCY * decay * (sine * c - cosine * s)
