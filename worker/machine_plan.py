"""Builds of tables of any machine: the option `--machine`, and the runs that its simulator has to make."""

import argparse
import hashlib
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import numpy as np

import slipstick
from slipstick.black_box import BlackBox, BlackBoxDescription, Cases, Simulation
from slipstick.black_box.simulation import FAILED, NONE
from slipstick.errors import InvalidValue
from slipstick.table import Axis

from .plan import Simulate, grid_points, slices

CHUNK = 20
"""Runs per chunk, the most that each worker of a killed build has to repeat."""


def add_machine_argument(parser: argparse.ArgumentParser) -> None:
    """Add the option."""
    parser.add_argument("--machine", type=Path, metavar="FILE.toml",
                        help="simulate another machine than the clutch of a bench: its inputs, conditions, output, and "
                             "its simulator, a Python callable or an UM-Bridge model (docs/any_machine.md)")


@dataclass(frozen=True, eq=False)
class MachineRuns:
    """Runs of a simulator at `design` (m, d) under the conditions of its file; a grid has `axes`."""

    file: BlackBox
    axes: tuple[Axis, ...]
    design: np.ndarray

    @classmethod
    def on_grid(cls, file: BlackBox, axes: tuple[Axis, ...]) -> "MachineRuns":
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
        return slices(len(self.design), max(1, CHUNK // len(self.conditions)))

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
        return f"slipstick {slipstick.__version__}, {self.model.simulator}" + f", at {address}" * bool(address)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the machine with its simulator, the conditions and the points."""
        names = [axis.name for axis in self.axes]
        description = json.dumps([self.model.digest, self.conditions.digest, names, self.file.simulator.timeout, CHUNK,
                                  self.design.tolist()])
        return hashlib.sha256(description.encode()).hexdigest()

    def points(self, chunk: slice) -> np.ndarray:
        """The points (m, d) of a chunk."""
        return self.design[chunk]

    def tell_failures(self, status: np.ndarray) -> None:
        """Print how many runs of (m, n) have no output, and why the first of those that failed did."""
        none, failed = (int(np.count_nonzero(status == code)) for code in (NONE, FAILED))
        if none or failed:
            print(f"{none + failed:,} of {status.size:,} runs have no output: {none:,} returned none, {failed:,} "
                  "failed", file=sys.stderr)
        if failed:
            row, condition = (int(index) for index in np.argwhere(status == FAILED)[0])
            inputs = ", ".join(f"{axis.name} {axis.nominal * multiple:.6g} {axis.unit}"
                               for axis, multiple in zip(self.axes, self.design[row], strict=True))
            print(f"The first that failed: {inputs}, {self.conditions.described(condition)}: "
                  f"{self.simulation.reason(self.design[row], self.conditions, condition)}", file=sys.stderr)


def open_machine_file(arguments: argparse.Namespace) -> BlackBox:
    """The file of `--machine`; raises `InvalidValue` also for options that are about the clutch only."""
    for option in ("model", "conditions"):
        if getattr(arguments, option):
            raise InvalidValue(f"--{option} and --machine exclude each other",
                               "The file of the machine describes its simulator and its conditions")
    return BlackBox.open(arguments.machine)


def machine_axes(file: BlackBox, texts: Sequence[str] | None, counted: bool) -> tuple[Axis, ...]:
    """Axes from NAME=LOW:HIGH, with :COUNT if `counted`; by default all inputs over their ranges."""
    if not texts:
        return tuple(_axis(file.description, entry.name, entry.lower, entry.upper, points if counted else 2)
                     for entry, points in zip(file.description.inputs, file.points, strict=True))
    axes = []
    for text in texts:
        name, _, span = text.partition("=")
        file.description.input(name)
        try:
            low, high, *count = span.split(":")
            (points,) = map(int, count) if counted else (2,)
            axes.append(_axis(file.description, name, float(low), float(high), points))
        except ValueError as error:
            form = "NAME=LOW:HIGH:COUNT" if counted else "NAME=LOW:HIGH"
            raise InvalidValue(f"'{text}' is not a valid axis", f"Write {form}, in multiples of nominal") from error
    return tuple(axes)


def _axis(machine: BlackBoxDescription, name: str, low: float, high: float, points: int) -> Axis:
    entry = machine.input(name)
    if low < entry.lower or high > entry.upper:
        raise InvalidValue(f"The axis {name} from {low:g} to {high:g} exceeds the range of the input, "
                           f"{entry.lower:g} to {entry.upper:g}",
                           "Narrow the axis, or widen the range in the file of the machine")
    return Axis(name, np.linspace(low, high, points), entry.nominal, entry.unit)
