"""What the sensors of the bench saw during each engagement, on one common clock."""

from dataclasses import dataclass

import numpy as np

from slipstick.errors import BadRecording

SIGNAL_UNITS = {"pressure": "bar", "input_speed": "rad/s", "output_speed": "rad/s", "output_torque": "N m"}
"""The signals in the order of the fields of `Signals`, and their units."""

LARGEST = 20_000_000
"""Most numbers of all signals of one file together: 160 MB in memory."""


@dataclass(frozen=True, eq=False)
class Signals:
    """`time` (k,) s rising from the shift command at t = 0; the others (n, k) in bar, rad/s, rad/s and N m.

    Raises `BadRecording`, which counts conditions and samples from 0.
    """

    time: np.ndarray
    pressure: np.ndarray
    input_speed: np.ndarray
    output_speed: np.ndarray
    output_torque: np.ndarray

    def __post_init__(self) -> None:
        """Check order, shapes and finiteness once."""
        time = self.time
        if time.ndim != 1 or len(time) < 2:
            raise BadRecording(f"The signals have {time.size} sample time(s)", "Give two or more in a row")
        late = np.flatnonzero(~(np.diff(time) > 0))
        if len(late) or not np.all(np.isfinite(time)):
            row = int(late[0]) + 1 if len(late) else 0
            raise BadRecording(f"The time of the signals does not rise at sample {row} ({time[row]:g} s)",
                               "Sort the samples by time, each time once")
        shape = (len(self.pressure), len(time))
        for name in SIGNAL_UNITS:
            values = getattr(self, name)
            if values.shape != shape:
                raise BadRecording(f"The signal {name} has shape {values.shape}, not {shape}",
                                   "Give every signal of every engagement at the same sample times")
            bad = np.argwhere(~np.isfinite(values))
            if len(bad):
                row, sample = bad[0]
                raise BadRecording(f"The signal {name} of condition {row} is not finite at sample {sample} "
                                   f"({time[sample]:g} s)", "Fill the gap, or leave the signals out")
