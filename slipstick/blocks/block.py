"""What all blocks have in common."""

from typing import Protocol

import numpy as np

from slipstick.errors import BadRecording
from slipstick.recordings import Recordings, Signals


class Block(Protocol):
    """A part of the model between measured signals: `output` names the signal that it predicts."""

    @property
    def output(self) -> str:
        """Name of the predicted signal."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters on which the prediction depends; the others are ignored."""

    def predict(self, vectors: np.ndarray) -> np.ndarray:
        """The output (n, k) at the sample times, in its unit, for parameter vectors (n, 20), one an engagement."""


def signals_of(recordings: Recordings) -> Signals:
    """The signals that a block is driven by; raises `BadRecording` where there are none."""
    if recordings.signals is None:
        raise BadRecording("These recordings have no signals, and a block is driven by measured signals",
                           "Record pressure, speeds and torque as well")
    return recordings.signals
