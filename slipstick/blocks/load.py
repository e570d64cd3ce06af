"""The load: the measured torque determines the output speed, by one scalar equation (the last line of eq. 3).

    Jo omega' = torque - b_ov omega - brake,   omega(0) = 0,   omega >= 0

The load rests until the torque exceeds the brake torque, and never runs backwards. Between two samples the torque is
taken as linear, for which the step is exact. At lock-up the torque jumps: the speed is then off by up to the jump times
half a sample over the load inertia.
"""

from dataclasses import dataclass

import numpy as np

from slipstick.bench import parameters
from slipstick.blocks.block import signals_of
from slipstick.blocks.relaxation import relaxed
from slipstick.recordings import Recordings

_VISCOUS = parameters.index("output_viscous")


@dataclass(frozen=True, eq=False)
class Load:
    """Output speed in rad/s at `time` (k,), from `torque` (n, k) in N m, `inertia` (n,) and `brake` (n,) in N m."""

    time: np.ndarray
    torque: np.ndarray
    inertia: np.ndarray
    brake: np.ndarray
    output: str = "output_speed"
    parameters: tuple[str, ...] = ("output_viscous",)

    @classmethod
    def of(cls, recordings: Recordings) -> "Load":
        """The load of recordings; raises `BadRecording` where they have no signals."""
        signals, conditions = signals_of(recordings), recordings.conditions
        return cls(signals.time, signals["output_torque"], conditions.load_inertia, conditions.brake_torque)

    def predict(self, vectors: np.ndarray) -> np.ndarray:
        """Output speed (n, k) in rad/s."""
        return relaxed(self.time, (self.torque - self.brake[:, None]) / self.inertia[:, None],
                       vectors[:, _VISCOUS] / self.inertia, np.zeros(len(vectors)), least=0.0)
