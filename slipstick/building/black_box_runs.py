"""The runs that the simulator of a black box has to make."""

import hashlib
import json
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from slipstick import __version__
from slipstick.black_box import BlackBox, BlackBoxDescription, Cases, Simulation
from slipstick.black_box.declared import Declared
from slipstick.black_box.simulation import FAILED, NONE
from slipstick.building.plan import Simulate, grid_points, slices
from slipstick.numerics.quantities import describe_quantity
from slipstick.table import Axis

CHUNK = 20
"""Runs per chunk, the most that each worker of a killed build has to repeat."""


@dataclass(frozen=True, eq=False)
class BlackBoxRuns:
    """Runs of a simulator at `design` (m, d) under the conditions of its file; a grid has `axes`."""

    file: BlackBox
    axes: tuple[Axis, ...]
    design: np.ndarray

    @classmethod
    def on_grid(cls, file: BlackBox, axes: tuple[Axis, ...]) -> "BlackBoxRuns":
        """The runs at the points of a grid."""
        return cls(file, axes, grid_points(axes, slice(0, int(np.prod([len(axis.values) for axis in axes])))))

    @property
    def model(self) -> BlackBoxDescription:
        """The machine."""
        return self.file.description

    @property
    def conditions(self) -> Cases:
        """The conditions of every point."""
        return self.file.cases

    @property
    def shape(self) -> tuple[int, ...]:
        """Grid points along each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def chunks(self) -> list[slice]:
        """Slices of the design."""
        return slices(len(self.design), max(1, self._most_runs // len(self.conditions)))

    @property
    def _most_runs(self) -> int:
        """Runs per chunk; a declared machine makes many at once."""
        return self.file.simulator.most_runs if isinstance(self.file.simulator, Declared) else CHUNK

    @property
    def simulation(self) -> Simulation:
        """The simulator over the axes."""
        return Simulation(self.file, tuple(axis.name for axis in self.axes))

    @property
    def simulate(self) -> Simulate:
        """The simulation of points in one process or thread."""
        return partial(self.simulation.simulate, cases=self.conditions)

    @property
    def origin(self) -> str:
        """The simulator, and where it was."""
        address = getattr(self.file.simulator, "url", "")
        return f"slipstick {__version__}, {self.model.simulator}" + f", at {address}" * bool(address)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the machine with its simulator, the conditions and the points."""
        names = [axis.name for axis in self.axes]
        description = json.dumps([self.model.digest, self.conditions.digest, names, self.file.simulator.timeout,
                                  self._most_runs, self.design.tolist()])
        return hashlib.sha256(description.encode()).hexdigest()

    def points(self, chunk: slice) -> np.ndarray:
        """The points (m, d) of a chunk."""
        return self.design[chunk]

    def failures(self, status: np.ndarray) -> list[str]:
        """How many runs of (m, n) have no output, and why the first of those that failed did: lines, if there are any.
        """
        none, failed = (int(np.count_nonzero(status == code)) for code in (NONE, FAILED))
        lines = []
        if none or failed:
            lines.append(f"{none + failed:,} of {status.size:,} runs have no output: {none:,} returned none, "
                         f"{failed:,} failed")
        if failed:
            row, condition = (int(index) for index in np.argwhere(status == FAILED)[0])
            inputs = ", ".join(describe_quantity(axis.name, axis.nominal * multiple, axis.unit, 6)
                               for axis, multiple in zip(self.axes, self.design[row], strict=True))
            lines.append(f"The first that failed: {inputs}, {self.conditions.described(condition)}: "
                         f"{self.simulation.reason(self.design[row], self.conditions, condition)}")
        return lines
