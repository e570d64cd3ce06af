"""Sensor signals of the test bench, all or some of four, sampled at the same times in every engagement."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from slipstick.errors import BadRecording

SIGNAL_UNITS = {"pressure": "bar", "input_speed": "rad/s", "output_speed": "rad/s", "output_torque": "N m"}
"""Units of the signals, in the order of the fields of `Signals`."""

NEEDED = {"valve": {"pressure"}, "contact": set(SIGNAL_UNITS), "clutch": set(SIGNAL_UNITS),
          "load": {"output_torque", "output_speed"}, "input": {"output_torque", "input_speed"},
          "lock": {"output_torque", "output_speed", "input_speed"}}
"""The signals of each block: those at both of its ends, and what its laws need."""

LARGEST = 20_000_000
"""Maximum number of samples of all signals in one file together: 160 MB in memory."""


@dataclass(frozen=True, eq=False)
class Signals:
    """Signals of n engagements, (n, k) each, in bar, rad/s, rad/s and N m, at the increasing times `time` (k,) in s.

    A signal that the bench does not measure is None; there is at least one. The shift command is at t = 0. Raises
    `BadRecording`, whose messages number conditions and samples from 0.
    """

    time: np.ndarray
    pressure: np.ndarray | None = None
    input_speed: np.ndarray | None = None
    output_speed: np.ndarray | None = None
    output_torque: np.ndarray | None = None

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
        if not self.names:
            raise BadRecording("There are times of samples and no signals",
                               f"Give at least one of {', '.join(SIGNAL_UNITS)}, or no signals at all")
        shape = (len(self), len(time))
        for name in self.names:
            values = self[name]
            if values.shape != shape:
                raise BadRecording(f"The signal {name} has shape {values.shape}, not {shape}",
                                   "Give every signal of every engagement at the same sample times")
            invalid = np.argwhere(~np.isfinite(values))
            if len(invalid):
                row, sample = invalid[0]
                raise BadRecording(f"The signal {name} of condition {row} is not finite at sample {sample} "
                                   f"({time[sample]:g} s)", "Leave out the engagement, or the signal")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the measured signals, in the order of `SIGNAL_UNITS`."""
        return tuple(name for name in SIGNAL_UNITS if getattr(self, name) is not None)

    @property
    def missing(self) -> tuple[str, ...]:
        """Names of the signals that are not measured."""
        return tuple(name for name in SIGNAL_UNITS if getattr(self, name) is None)

    def __len__(self) -> int:
        """Number of engagements."""
        return len(self[self.names[0]])

    def __getitem__(self, name: str) -> np.ndarray:
        """The measured signal `name` (n, k); raises `BadRecording` if it was not measured."""
        values = getattr(self, name)
        if values is None:
            raise BadRecording(f"The recordings have no {name.replace('_', ' ')}", f"Record {name} as well")
        return np.asarray(values)

    def take(self, rows: np.ndarray | slice) -> "Signals":
        """The engagements `rows`."""
        return replace(self, **{name: self[name][rows] for name in self.names})


@dataclass(frozen=True, eq=False)
class FurtherChannel:
    """A channel beside the signals, such as an oil temperature: `values` (n, k) in `unit` at the times of the signals.

    The model does not use it; laws of a study may depend on it.
    """

    unit: str
    values: np.ndarray


def open_blocks(signals: Collection[str]) -> tuple[str, ...]:
    """The blocks that can be asked where these signals were measured."""
    return tuple(block for block, needed in NEEDED.items() if needed <= set(signals))
