"""The surrogate: a network trained on simulations at random points of a box, for more axes than a grid can have."""

from dataclasses import dataclass
from typing import ClassVar, Literal, Self

import h5py
import numpy as np

from slipstick.clutch.conditions import Conditions
from slipstick.clutch.model import Model
from slipstick.errors import CorruptTable, InvalidValue
from slipstick.storage.hdf5 import Source
from slipstick.table import store
from slipstick.table.axis import Axis, box
from slipstick.table.network import Network
from slipstick.table.points import Outside, placed
from slipstick.table.table import Table

_LARGEST_COUNT = 1 << 53  # beyond it a float skips whole numbers


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Error of n conditions against direct simulation at `points` random points that the training never saw.

    `rms` and `worst`, shape (n,), are in s. Raises `InvalidValue` where they are no errors.
    """

    points: int
    rms: np.ndarray
    worst: np.ndarray

    def __post_init__(self) -> None:
        """Check once."""
        if self.points < 1 or not np.all((self.rms >= 0) & (self.rms <= self.worst) & np.isfinite(self.worst)):
            raise InvalidValue("The held-out errors are none", "Give 0 <= rms <= worst at one point or more")

    @property
    def overall_rms(self) -> float:
        """Root of the mean squared error over points and conditions, s."""
        return float(np.sqrt(np.mean(self.rms**2)))

    @classmethod
    def of(cls, difference: np.ndarray) -> "HeldOut":
        """The error of differences (m, n) in s at m points."""
        # The RMS of equal numbers may exceed them by a rounding.
        worst = np.abs(difference).max(axis=0)
        return cls(len(difference), np.minimum(np.sqrt(np.mean(difference**2, axis=0)), worst), worst)


@dataclass(frozen=True, eq=False)
class Surrogate(Table):
    """`network` from germs, the axes scaled to mean 0 and variance 1 over the box, to n shifting times in s.

    It was trained on `runs` simulated points in `steps` steps from `seed`. Each axis has two values, the ends of the
    box. Every engagement in it locks, as far as the runs and the held-out points of `error` tell: none was left out.
    Raises `InvalidValue` where these do not fit together.
    """

    kind: ClassVar[Literal["surrogate"]] = "surrogate"
    layout: ClassVar[str] = "slipstick surrogate"

    axes: tuple[Axis, ...]
    network: Network
    error: HeldOut
    runs: int
    steps: int
    seed: int
    conditions: Conditions
    model: Model
    origin: str = ""

    def __post_init__(self) -> None:
        """Check what the network and its error belong to."""
        self._check()
        shape = len(self.axes), len(self.conditions)
        if (self.network.weights[0].shape[0], self.network.weights[-1].shape[1]) != shape:
            raise InvalidValue(f"The network does not take {shape[0]} axes to {shape[1]} conditions",
                               "Give one input an axis and one output a condition")
        if not self.error.rms.shape == self.error.worst.shape == shape[1:]:
            raise InvalidValue("The held-out errors are not one a condition", f"Give {shape[1]} of each")
        if any(len(axis.values) != 2 for axis in self.axes):
            raise InvalidValue("An axis of the surrogate has more than its two ends", "Give the ends of the box")

    @property
    def knots(self) -> None:
        """None: times are smooth throughout."""
        return None

    def interpolate(self, points: np.ndarray, outside: Outside = "clip") -> np.ndarray:
        """As `Table.interpolate`, by the network."""
        clipped, inside = placed(self.axes, points, outside)
        times = self.network(germs(self.axes, clipped))
        if outside == "nan":
            times[~inside] = np.nan
        return times

    @property
    def _arrays(self) -> tuple[np.ndarray, ...]:
        made = np.array([self.runs, self.steps, self.seed, self.error.points], dtype=np.int64)
        return *self.network.weights, *self.network.biases, self.error.rms, self.error.worst, made

    def _take(self, rows: np.ndarray) -> Self:
        error = HeldOut(self.error.points, self.error.rms[rows], self.error.worst[rows])
        return type(self)(self.axes, self.network.take(rows), error, self.runs, self.steps, self.seed,
                          self.conditions.take(rows), self.model, self.origin)

    def _write(self, file: h5py.File) -> None:
        def lay(path: str, values: np.ndarray, units: str) -> None:
            dataset = file.create_dataset(path, data=values, dtype="<f8", chunks=values.shape, fletcher32=True)
            store.describe(dataset, units=units)

        last = len(self.network.weights) - 1
        for number, (weight, bias) in enumerate(zip(self.network.weights, self.network.biases, strict=True)):
            lay(f"network/{number}/weight", weight, "s" if number == last else "1")
            lay(f"network/{number}/bias", bias, "s" if number == last else "1")
        lay("error/rms", self.error.rms, "s")
        lay("error/worst", self.error.worst, "s")
        file["error"].attrs["points"] = self.error.points
        file["network"].attrs.update(layers=last + 1, runs=self.runs, steps=self.steps, seed=self.seed)

    @classmethod
    def _read(cls, source: Source, axes: tuple[Axis, ...], conditions: Conditions, model: Model, origin: str) -> Self:
        layers, runs, steps, seed = (_count(source, "network", name) for name in ("layers", "runs", "steps", "seed"))
        weights, biases = [], []
        for number in range(layers):
            unit = "s" if number == layers - 1 else "1"
            weights.append(source.array(f"network/{number}/weight", "f", (None, None), unit))
            biases.append(source.array(f"network/{number}/bias", "f", (None,), unit))
        error = HeldOut(_count(source, "error", "points"), source.array("error/rms", "f", (None,), "s"),
                        source.array("error/worst", "f", (None,), "s"))
        return cls(axes, Network(tuple(weights), tuple(biases)), error, runs, steps, seed, conditions, model, origin)


def _count(source: Source, path: str, name: str) -> int:
    number = source.number(path, name)
    if not (number.is_integer() and 0 <= number <= _LARGEST_COUNT):
        raise CorruptTable(f"The attribute '{name}' of '{path}' is {number:g}, no count", store.REBUILD)
    return int(number)


def germs(axes: tuple[Axis, ...], points: np.ndarray) -> np.ndarray:
    """The points (m, d) scaled so that, uniform over the box, they have mean 0 and variance 1."""
    lower, upper = box(axes)
    scaled: np.ndarray = np.sqrt(12) * (points - (lower + upper) / 2) / (upper - lower)
    return scaled
