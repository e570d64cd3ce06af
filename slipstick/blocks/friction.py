"""Friction in full contact: the torque is proportional to the pressure, whatever the piston did before (eqs. 1 and 2).

    torque = g_r alpha z_contact/(z_contact - beta) 1e5 pressure

The torque is modelled, and not the ratio of torque to pressure, in which the noise of the pressure would be a bias.
"""

from dataclasses import dataclass

import numpy as np

from slipstick.bench import parameters
from slipstick.blocks.block import signals_of
from slipstick.recordings import Recordings

_CONTACT, _LENGTH, _FRICTION, _GEAR = (
    parameters.index(name) for name in ("contact_position", "contact_length", "friction_coefficient", "gear_ratio"))


@dataclass(frozen=True, eq=False)
class Friction:
    """Output torque in N m from `pressure` (n, k) in bar; valid where the plates slip in full contact."""

    pressure: np.ndarray
    output: str = "output_torque"
    parameters: tuple[str, ...] = ("friction_coefficient", "gear_ratio", "contact_position", "contact_length")

    @classmethod
    def of(cls, recordings: Recordings) -> "Friction":
        """The friction of recordings; raises `BadRecording` where they have no signals."""
        return cls(signals_of(recordings)["pressure"])

    def predict(self, vectors: np.ndarray) -> np.ndarray:
        """Output torque (n, k) in N m as if the plates were in full contact throughout."""
        contact = vectors[:, _CONTACT] / (vectors[:, _CONTACT] - vectors[:, _LENGTH])
        factor = vectors[:, _GEAR] * vectors[:, _FRICTION] * contact * 1e5
        return np.asarray(factor[:, None] * np.maximum(0, self.pressure))
