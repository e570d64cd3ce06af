"""A surrogate: a network trained on simulations at random points of a box, for more axes than a grid can have."""

from dataclasses import dataclass
from typing import ClassVar, Literal, Self

import h5py
import numpy as np

from slipstick.errors import CorruptTable, InvalidValue
from slipstick.storage.hdf5 import Source
from slipstick.table import store
from slipstick.table.axis import Axis, box
from slipstick.table.derivatives import Derivatives
from slipstick.table.network import Network
from slipstick.table.points import Outside, clip_points
from slipstick.table.subject import Setting, Subject, output_of
from slipstick.table.table import Table

_LARGEST_COUNT = 1 << 53  # up to which a float64 represents every integer


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Error relative to direct simulation at `points` random points that were not used for training.

    `rms` and `worst` (n,) are the RMS and the largest error of each condition in s. Raises `InvalidValue` unless
    0 <= rms <= worst.
    """

    points: int
    rms: np.ndarray
    worst: np.ndarray

    def __post_init__(self) -> None:
        """Check that the errors are finite and consistent."""
        if self.points < 1 or not np.all((self.rms >= 0) & (self.rms <= self.worst) & np.isfinite(self.worst)):
            raise InvalidValue("The held-out errors are invalid",
                               "Give finite values 0 <= rms <= worst from at least one point")

    @property
    def overall_rms(self) -> float:
        """RMS error over all points and conditions in s."""
        return float(np.sqrt(np.mean(self.rms**2)))

    @classmethod
    def of(cls, difference: np.ndarray) -> "HeldOut":
        """Return the held-out error of the differences (m, n) in s at m points."""
        # Rounding can make the RMS of equal numbers larger than the numbers.
        worst = np.abs(difference).max(axis=0)
        return cls(len(difference), np.minimum(np.sqrt(np.mean(difference**2, axis=0)), worst), worst)


@dataclass(frozen=True, eq=False)
class Surrogate(Table):
    """A `network` that maps germs, standardised multipliers of the axes, to n shifting times in s.

    It was trained on simulations at `runs` points, in `steps` steps, with the random seed `seed`. Each axis has two
    values, the bounds of the box. All engagements locked at the training points and at the held-out points of `error`.
    Raises `InvalidValue` if the fields are inconsistent.
    """

    kind: ClassVar[Literal["surrogate"]] = "surrogate"
    layout: ClassVar[str] = "slipstick surrogate"

    axes: tuple[Axis, ...]
    network: Network
    error: HeldOut
    runs: int
    steps: int
    seed: int
    conditions: Setting
    model: Subject
    origin: str = ""

    def __post_init__(self) -> None:
        """Check that the network and its error match the axes and conditions."""
        self._check()
        shape = len(self.axes), len(self.conditions)
        if (self.network.weights[0].shape[0], self.network.weights[-1].shape[1]) != shape:
            raise InvalidValue(f"The network does not map {shape[0]} axes to {shape[1]} conditions",
                               "Give one input per axis and one output per condition")
        if not self.error.rms.shape == self.error.worst.shape == shape[1:]:
            raise InvalidValue("The number of held-out errors is not the number of conditions",
                               f"Give {shape[1]} values of each error")
        if any(len(axis.values) != 2 for axis in self.axes):
            raise InvalidValue("An axis of the surrogate has more than two values",
                               "Give only the lower and the upper bound of the box")

    @property
    def knots(self) -> None:
        """None, because the times are smooth."""
        return None

    def interpolate(self, points: np.ndarray, outside: Outside = "clip") -> np.ndarray:
        """As `Table.interpolate`; the times are those of the network."""
        clipped, inside = clip_points(self.axes, points, outside)
        times = self.network(germs(self.axes, clipped))
        if outside == "nan":
            times[~inside.all(axis=1)] = np.nan
        return times

    def _derivatives(self, point: np.ndarray) -> Derivatives:
        scale = np.sqrt(12) / (self.upper - self.lower)
        return self.network.derivatives(germs(self.axes, point[None])[0]).along(scale)

    @property
    def _arrays(self) -> tuple[np.ndarray, ...]:
        counts = np.array([self.runs, self.steps, self.seed, self.error.points], dtype=np.int64)
        return *self.network.weights, *self.network.biases, self.error.rms, self.error.worst, counts

    def _take(self, rows: np.ndarray) -> Self:
        error = HeldOut(self.error.points, self.error.rms[rows], self.error.worst[rows])
        return type(self)(self.axes, self.network.take(rows), error, self.runs, self.steps, self.seed,
                          self.conditions.take(rows), self.model, self.origin)

    def _write(self, file: h5py.File) -> None:
        def write(path: str, values: np.ndarray, units: str) -> None:
            dataset = file.create_dataset(path, data=values, dtype="<f8", chunks=values.shape, fletcher32=True)
            store.describe(dataset, units=units)

        last = len(self.network.weights) - 1
        for number, (weight, bias) in enumerate(zip(self.network.weights, self.network.biases, strict=True)):
            write(f"network/{number}/weight", weight, self.output.unit if number == last else "1")
            write(f"network/{number}/bias", bias, self.output.unit if number == last else "1")
        write("error/rms", self.error.rms, self.output.unit)
        write("error/worst", self.error.worst, self.output.unit)
        file["error"].attrs["points"] = self.error.points
        file["network"].attrs.update(layers=last + 1, runs=self.runs, steps=self.steps, seed=self.seed)

    @classmethod
    def _read(cls, source: Source, axes: tuple[Axis, ...], conditions: Setting, model: Subject, origin: str) -> Self:
        unit_of_output = output_of(model).unit
        layers, runs, steps, seed = (_count(source, "network", name) for name in ("layers", "runs", "steps", "seed"))
        weights, biases = [], []
        for number in range(layers):
            unit = unit_of_output if number == layers - 1 else "1"
            weights.append(source.array(f"network/{number}/weight", "f", (None, None), unit))
            biases.append(source.array(f"network/{number}/bias", "f", (None,), unit))
        error = HeldOut(_count(source, "error", "points"), source.array("error/rms", "f", (None,), unit_of_output),
                        source.array("error/worst", "f", (None,), unit_of_output))
        return cls(axes, Network(tuple(weights), tuple(biases)), error, runs, steps, seed, conditions, model, origin)


def _count(source: Source, path: str, name: str) -> int:
    number = source.number(path, name)
    if not (number.is_integer() and 0 <= number <= _LARGEST_COUNT):
        raise CorruptTable(f"The attribute '{name}' of '{path}' is {number:g}, which is not a count", store.REBUILD)
    return int(number)


def germs(axes: tuple[Axis, ...], points: np.ndarray) -> np.ndarray:
    """Points (m, d) standardised: uniform points of the box have mean 0 and variance 1 along every axis."""
    lower, upper = box(axes)
    scaled: np.ndarray = np.sqrt(12) * (points - (lower + upper) / 2) / (upper - lower)
    return scaled
