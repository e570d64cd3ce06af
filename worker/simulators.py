"""The simulators of fits by direct simulation: on this machine, or on the workers of a Dask cluster."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from slipstick.bench import Conditions
from slipstick.black_box import BlackBox, BlackBoxDescription, Function, Workers
from slipstick.clutch.ensemble import Simulator
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.uncertainty.likelihood import ShiftingTimeModel

from .cluster import Cluster
from .executors import explained

_clusters: dict[tuple[str, bool], Cluster] = {}
_workers: dict[str, Workers] = {}
"""What this process has started, by address and by digest of the machine: it serves all steps."""


@dataclass(frozen=True)
class Simulators:
    """What the fits of a worker may simulate, and on which Dask scheduler; None is this machine."""

    machines: Mapping[str, BlackBox] = field(default_factory=dict)
    """Other machines than the clutch, by their digests."""
    dask: str | None = None

    def of_clutch(self, model: Model, axes: tuple[str, ...]) -> ShiftingTimeModel:
        """The simulation of a clutch; raises `InvalidValue`."""
        if self.dask is None:
            return Simulator(model, axes)
        return partial(_spread, _cluster(self.dask), Simulator(model, axes, threads=1))

    def of_machine(self, machine: BlackBoxDescription, axes: Sequence[str]) -> ShiftingTimeModel:
        """The simulation of another machine; raises `InvalidValue`."""
        file = self.machines.get(machine.digest)
        if file is None:
            raise InvalidValue(f"This worker has no simulator of '{machine.title}', which the table names as "
                               f"{machine.simulator[:200]}",
                               "Start it with `work --machine FILE`, the file from which the table was "
                               "built")
        workers = self._workers(file)

        def simulate(points: np.ndarray, conditions: Any, /) -> np.ndarray:
            with explained():
                return workers.simulate(tuple(axes), points, conditions)[0]

        return simulate

    def _workers(self, file: BlackBox) -> Workers:
        if self.dask is not None:
            cluster = _cluster(self.dask, isinstance(file.simulator, Function))
            return Workers(file, cluster.threads, cluster)
        if file.description.digest not in _workers:
            _workers[file.description.digest] = Workers(file, os.cpu_count() or 1)
        return _workers[file.description.digest]


def _cluster(address: str, needs_main_thread: bool = False) -> Cluster:
    """The cluster, which is joined again if its scheduler was restarted."""
    key = address, needs_main_thread
    if key not in _clusters or not _clusters[key].is_connected:
        _clusters[key] = Cluster(address, needs_main_thread)
    return _clusters[key]


def _spread(cluster: Cluster, simulator: Simulator, points: np.ndarray, conditions: Conditions, /) -> np.ndarray:
    """Shifting times (m, n) at the points (m, d), a part on each thread of the cluster."""
    parts = np.array_split(points, max(1, min(len(points), cluster.threads)))
    with explained():
        return np.concatenate(list(cluster.map(simulator, parts, [conditions] * len(parts))))
