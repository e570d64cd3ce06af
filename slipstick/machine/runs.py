"""Recorded runs of a machine: signals on one clock, commands, and what is constant in a run."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import scipy

from slipstick.errors import InvalidValue, UnknownName
from slipstick.storage.files import replacing


@dataclass(frozen=True, eq=False)
class Profile:
    """A command as corners: `time` (n, m) in s and `value` (n, m), linear between them and constant beyond."""

    time: np.ndarray
    value: np.ndarray

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return the command (n, k) at instants (k,)."""
        return np.array([np.interp(time, *corners) for corners in zip(self.time, self.value, strict=True)])

    def approximate(self, time: np.ndarray) -> np.ndarray:
        """Return values (n, k) at even instants (k,) between which lines are closest to the command, in least squares.

        Equations that are driven by these lines lack nothing of the integral of a command whose corners lie between
        the instants.
        """
        distinct, rows = np.unique(np.stack([self.time, self.value], axis=1), axis=0, return_inverse=True)
        profile = Profile(distinct[:, 0], distinct[:, 1])
        values = profile.at(time)
        if len(time) < 3:
            return values[rows]
        hats = np.array([_weigh_hats(*corners, time) for corners in zip(profile.time, profile.value, strict=True)])
        hats[:, [0, -1]] -= values[:, [0, -1]] / 6  # the command itself at both ends
        bands = np.array([[1 / 6], [2 / 3], [1 / 6]]) * np.ones(len(time) - 2)
        values[:, 1:-1] = scipy.linalg.solve_banded((1, 1), bands, hats.T).T
        return values[rows]


def _weigh_hats(corners: np.ndarray, values: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return the means (k - 2,) of what is linear between corners, under a hat about each inner one of even instants.
    """
    grid = np.unique(np.concatenate([time, corners[(corners > time[0]) & (corners < time[-1])]]))
    value, width, step = np.interp(grid, corners, values), np.diff(grid), np.searchsorted(time, grid[:-1], "right") - 1
    length = (time[-1] - time[0]) / (len(time) - 1)
    begin, end = ((instants - time[step]) / length for instants in (grid[:-1], grid[1:]))  # of a piece in its step
    whole = np.bincount(step, width * (value[:-1] + value[1:]) / 2)
    rising = np.bincount(step, width * (value[:-1] * (2 * begin + end) + value[1:] * (begin + 2 * end)) / 6)
    return np.asarray((rising[:-1] + (whole - rising)[1:]) / length)


@dataclass(frozen=True, eq=False)
class Runs:
    """n runs of a machine with k samples at `time` (k,) in s.

    `signals` (n, k) are measured, `commands` are profiles, `conditions` (n,) are stated. `channels` are further
    recorded constants (n,) or signals (n, k), and `order` (n,) is the order of the runs, where it is known. `units` are
    those of all of them by name, as far as they are known, and `machine` is the name of the machine. `names` say where
    each run is from, such as from which file; there are none where that is not known.
    """

    time: np.ndarray
    signals: Mapping[str, np.ndarray]
    commands: Mapping[str, Profile] = field(default_factory=dict)
    conditions: Mapping[str, np.ndarray] = field(default_factory=dict)
    channels: Mapping[str, np.ndarray] = field(default_factory=dict)
    order: np.ndarray | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    machine: str = ""
    description: str = ""
    names: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(next(iter(self.signals.values())))

    def take(self, rows: slice | np.ndarray) -> "Runs":
        """Return the runs `rows`, in this order."""
        def chosen(values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
            return {name: value[rows] for name, value in values.items()}

        commands = {name: Profile(each.time[rows], each.value[rows]) for name, each in self.commands.items()}
        return replace(self, signals=chosen(self.signals), commands=commands, conditions=chosen(self.conditions),
                       channels=chosen(self.channels), order=None if self.order is None else self.order[rows],
                       names=tuple(np.array(self.names, object)[rows]) if self.names else ())

    @classmethod
    def open(cls, path: Path | str) -> "Runs":
        """Read the runs of a file; raises `BadRecording`, and `UnknownName` where there is no file."""
        from slipstick.machine.runs_file import read_runs  # which needs this class

        if not Path(path).is_file():
            beside = [each.name for each in Path(path).parent.glob("*.h5")]
            raise UnknownName.of("recordings file", Path(path).name, beside)
        return read_runs(Path(path))

    def save(self, path: Path | str) -> Path:
        """Write the runs as an HDF5 file, and return its path; raises `InvalidValue` unless it ends in `.h5`."""
        from slipstick.machine.runs_file import write_runs  # which needs this class

        if Path(path).suffix != ".h5":
            raise InvalidValue(f"'{path}' is not the name of an HDF5 file", "End it in .h5")
        with replacing(Path(path)) as temporary:
            temporary.write_bytes(write_runs(self))
        return Path(path)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of what was recorded, whatever it is called and described."""
        hashed = hashlib.sha256(np.ascontiguousarray(self.time, "<f8").tobytes())
        for name, values in self.arrays().items():
            hashed.update(f"{name} [{self.units.get(name.rpartition('/')[2], '')}] {values.shape};".encode())
            hashed.update(np.ascontiguousarray(values, "<f8").tobytes())
        return hashed.hexdigest()

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all that was recorded beside the time, by its place in the file."""
        groups = {"signals": self.signals, "conditions": self.conditions, "channels": self.channels}
        commands = {f"commands/{name} {what}": getattr(profile, what)
                    for name, profile in sorted(self.commands.items()) for what in ("time", "value")}
        return {**{f"{group}/{name}": values[name] for group, values in groups.items() for name in sorted(values)},
                **commands, **({} if self.order is None else {"order": self.order})}

    @property
    def step(self) -> float:
        """Sample time in s."""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)
