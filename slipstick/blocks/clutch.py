"""The clutch up to lock-up: measured pressure and speeds determine the torque, by the piston of eq. 1 and by eq. 2.

The measured pressure is taken as linear between samples. The piston equation contains its derivative; with the state
w = x3 - a2/c2 x1 it does not:

    w' = b2/c2 (x1 - aa) - d2/c2 (w + a2/c2 x1)
"""

from dataclasses import dataclass

import numpy as np

from slipstick.bench import parameters
from slipstick.blocks.block import signals_of
from slipstick.blocks.relaxation import relaxed
from slipstick.recordings import Recordings

PISTON = ("piston_pressure_rate", "piston_pressure", "piston_inertia", "piston_return", "pressure_bias",
          "temperature_gain", "contact_position", "initial_position")
"""Parameters of the closing piston."""
_NAMES = (*PISTON, "contact_length", "film_coefficient", "friction_coefficient", "gear_ratio", "ramp_share")


@dataclass(frozen=True, eq=False)
class Clutch:
    """Output torque in N m at `time` (k,) of slipping plates, from `pressure`, `input_speed`, `output_speed` (n, k)."""

    time: np.ndarray
    pressure: np.ndarray
    input_speed: np.ndarray
    output_speed: np.ndarray
    output: str = "output_torque"
    parameters: tuple[str, ...] = _NAMES

    @classmethod
    def of(cls, recordings: Recordings) -> "Clutch":
        """The clutch of recordings; raises `BadRecording` where they have no signals."""
        signals = signals_of(recordings)
        return cls(signals.time, signals["pressure"], signals["input_speed"], signals["output_speed"])

    def piston_position(self, vectors: np.ndarray) -> np.ndarray:
        """Position (n, k) of the piston in m, between 0 and contact."""
        p = {name: vectors[:, parameters.index(name), None] for name in _NAMES}
        rate, onto = p["piston_return"] / p["piston_inertia"], p["piston_pressure_rate"] / p["piston_inertia"]
        forcing = (p["piston_pressure"] / p["piston_inertia"] * (self.pressure - p["pressure_bias"])
                   - rate * onto * self.pressure)
        # The pressure starts at 0 (eq. 1); the first sample of a noisy sensor does not.
        state = relaxed(self.time, forcing, rate[:, 0], p["initial_position"][:, 0]) + onto * self.pressure
        return np.asarray(np.clip(p["temperature_gain"] * state, 0, p["contact_position"]))

    def predict(self, vectors: np.ndarray) -> np.ndarray:
        """Output torque (n, k) in N m as if the plates slipped throughout: valid up to lock-up."""
        p = {name: vectors[:, parameters.index(name), None] for name in _NAMES}
        position = self.piston_position(vectors)
        contact = p["contact_position"]
        s = np.clip((position / contact - 1 + p["ramp_share"]) / p["ramp_share"], 0, 1)
        closing = (1 - s) * (1 + 2 * s) / (p["ramp_share"] * contact)
        per_gap = np.where(s > 0, closing, 1 / np.maximum(contact - position, p["ramp_share"] * contact))
        slip = self.input_speed / p["gear_ratio"] - self.output_speed
        force = position / (contact - p["contact_length"]) * 1e5 * np.maximum(0, self.pressure)
        friction = s**2 * (3 - 2 * s) * p["friction_coefficient"] * force
        return np.asarray(p["gear_ratio"] * (friction + p["film_coefficient"] * per_gap * slip))
