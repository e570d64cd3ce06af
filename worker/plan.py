"""The plan of a build: a model, a grid of multipliers and n conditions, divided into chunks."""

import hashlib
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

import slipstick.clutch
from slipstick.bench.conditions import Conditions
from slipstick.clutch.ensemble import Accuracy
from slipstick.clutch.model import Model
from slipstick.table import Axis

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
        total = int(np.prod(self.shape))
        return [slice(first, min(first + size, total)) for first in range(0, total, size)]

    def points(self, chunk: slice) -> np.ndarray:
        """Multipliers (m, d) at the grid points of `chunk`."""
        indices = np.unravel_index(np.arange(chunk.start, chunk.stop), self.shape)
        return np.column_stack([axis.values[index] for axis, index in zip(self.axes, indices, strict=True)])

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that determines the result, including the simulator source: only equal builds share chunks."""
        columns = [column.tolist() for column in self.conditions.columns(self.model.uses_run_order)]
        axes = [(axis.name, axis.values.tolist()) for axis in self.axes]
        description = json.dumps([self.model.digest, columns, axes, vars(self.accuracy), CHUNK])
        hashed = hashlib.sha256(description.encode())
        for path in sorted(Path(slipstick.clutch.__path__[0]).rglob("*.py")):
            hashed.update(path.read_bytes())
        return hashed.hexdigest()
