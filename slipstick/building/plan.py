"""The plan of a build: a model, a grid of multipliers and n conditions, divided into chunks."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Protocol

import numpy as np

from slipstick import __version__, clutch
from slipstick.bench.conditions import Conditions
from slipstick.clutch.ensemble import Accuracy, shifting_times
from slipstick.clutch.model import Model
from slipstick.table import Axis
from slipstick.table.subject import Setting, Subject

Simulate = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Points (m, d) -> outputs and statuses (m, n); can be sent to another process."""


class Runs(Protocol):
    """Simulations at many points, divided into chunks. `digest` identifies all that determines the results."""

    @property
    def conditions(self) -> Setting:
        """The n conditions of every point."""

    @property
    def chunks(self) -> list[slice]:
        """Slices of the points."""

    @property
    def digest(self) -> str:
        """Builds with the same digest share chunks."""

    @property
    def simulate(self) -> Simulate:
        """The simulation of points."""

    def points(self, chunk: slice) -> np.ndarray:
        """The points (m, d) of a chunk, in multiples of nominal."""


class GridRuns(Runs, Protocol):
    """Simulations at the points of a grid."""

    @property
    def model(self) -> Subject:
        """What is simulated."""

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes of the grid."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Grid points along each axis."""

    @property
    def origin(self) -> str:
        """How the results are computed, in words."""


CHUNK = 20_000
"""Engagements per chunk: about 0.05 s of work, the most that each thread of a killed build has to repeat."""


@dataclass(frozen=True, eq=False)
class Plan:
    """One simulation at each of the G grid points (the last axis runs fastest) for each of the n conditions."""

    model: Model
    conditions: Conditions
    axes: tuple[Axis, ...]
    accuracy: Accuracy

    @property
    def shape(self) -> tuple[int, ...]:
        """Grid points along each axis, (g1, ..., gd)."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def chunks(self) -> list[slice]:
        """Slices of the grid points, which depend on the plan only."""
        size = max(1, CHUNK // len(self.conditions))
        return slices(int(np.prod(self.shape)), size)

    @property
    def simulate(self) -> Simulate:
        """The simulation of points in one thread."""
        names = [axis.name for axis in self.axes]
        return partial(shifting_times, self.model, self.conditions, names, accuracy=self.accuracy, threads=1)

    @property
    def origin(self) -> str:
        """How the shifting times are computed, in words."""
        return (f"slipstick {__version__}, longest steps {self.accuracy.fine:g} s near contact and "
                f"{self.accuracy.coarse:g} s elsewhere, twice that while the pressure is smooth")

    def points(self, chunk: slice) -> np.ndarray:
        """Multipliers (m, d) at the grid points of `chunk`."""
        return grid_points(self.axes, chunk)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that determines the result, including the simulator source: only equal builds share chunks."""
        columns = [column.tolist() for column in self.conditions.columns(self.model.uses_run_order)]
        axes = [(axis.name, axis.values.tolist()) for axis in self.axes]
        description = json.dumps([self.model.digest, columns, axes, vars(self.accuracy), CHUNK])
        hashed = hashlib.sha256(description.encode())
        for path in sorted(Path(clutch.__path__[0]).rglob("*.py")):
            hashed.update(path.read_bytes())
        return hashed.hexdigest()


def slices(total: int, size: int) -> list[slice]:
    """`total` points in slices of `size`."""
    return [slice(first, min(first + size, total)) for first in range(0, total, size)]


def grid_points(axes: Sequence[Axis], chunk: slice) -> np.ndarray:
    """Multipliers (m, d) at a slice of the points of a grid, whose last axis runs fastest."""
    indices = np.unravel_index(np.arange(chunk.start, chunk.stop), tuple(len(axis.values) for axis in axes))
    return np.column_stack([axis.values[index] for axis, index in zip(axes, indices, strict=True)])
