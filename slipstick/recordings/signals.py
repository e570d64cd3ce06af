"""Sensor signals of the test bench, sampled at the same times in every engagement."""

from dataclasses import dataclass

import numpy as np

from slipstick.errors import BadRecording

SIGNAL_UNITS = {"pressure": "bar", "input_speed": "rad/s", "output_speed": "rad/s", "output_torque": "N m"}
"""Units of the signals, in the order of the fields of `Signals`."""

LARGEST = 20_000_000
"""Maximum number of samples of all signals in one file together: 160 MB in memory."""


@dataclass(frozen=True, eq=False)
class Signals:
    """Signals of n engagements, (n, k) each, in bar, rad/s, rad/s and N m, at the increasing times `time` (k,) in s.

    The shift command is at t = 0. Raises `BadRecording`, whose messages number conditions and samples from 0.
    """

    time: np.ndarray
    pressure: np.ndarray
    input_speed: np.ndarray
    output_speed: np.ndarray
    output_torque: np.ndarray

    def __post_init__(self) -> None:
        """Check order, shapes and finiteness."""
        time = self.time
        if time.ndim != 1 or len(time) < 2:
            raise BadRecording(f"The times of the signals have shape {time.shape}",
                               "Give a one-dimensional array of at least two times")
        not_increasing = np.flatnonzero(~(np.diff(time) > 0))
        if len(not_increasing) or not np.all(np.isfinite(time)):
            sample = int(not_increasing[0]) + 1 if len(not_increasing) else 0
            raise BadRecording(f"The time of the signals does not increase at sample {sample} ({time[sample]:g} s)",
                               "Sort the samples by time and remove duplicates")
        shape = (len(self.pressure), len(time))
        for name in SIGNAL_UNITS:
            values = getattr(self, name)
            if values.shape != shape:
                raise BadRecording(f"The signal {name} has shape {values.shape}, not {shape}",
                                   "Give every signal of every engagement at the same sample times")
            invalid = np.argwhere(~np.isfinite(values))
            if len(invalid):
                row, sample = invalid[0]
                raise BadRecording(f"The signal {name} of condition {row} is not finite at sample {sample} "
                                   f"({time[sample]:g} s)", "Fill the gap, or leave out all signals")


@dataclass(frozen=True, eq=False)
class FurtherChannel:
    """A channel beside the signals, such as an oil temperature: `values` (n, k) in `unit` at the times of the signals.

    The model does not use it; studies may.
    """

    unit: str
    values: np.ndarray
