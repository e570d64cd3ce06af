"""The arguments of a likelihood: a model of shifting times, the measured times, and candidate inputs."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood.line_rules import Knots

_LEAST_NOISE, _MOST_NOISE = 1e-100, 1e100  # range of the output std whose squares neither underflow nor overflow
_RESOLUTION = 1e-15  # rounding error of the outputs relative to the largest, below which no noise can be told


@dataclass(frozen=True, eq=False)
class Lattice:
    """Points `normals` (m, d) of a lattice of standard normals with cells of the given `size`."""

    normals: np.ndarray
    size: float


class ShiftingTimeModel(Protocol):
    """The protocol of a model: points (m, d) in multiples of nominal -> shifting times (m, n) in s.

    A time is NaN if the engagement does not lock.
    """

    def __call__(self, points: np.ndarray, conditions: Any, /) -> np.ndarray:
        """Shifting times of all conditions at all points."""


@dataclass(frozen=True, eq=False)
class InferenceProblem:
    """A model, conditions, their measured times (n,), and the domain of the model, the box `lower`, `upper` (d,).

    Times, or the outputs of another machine that take their place, are in `unit`. A fit searches the std of their noise
    within `output_std_bounds` by default; unless given, they are those of shifting times.

    `axes` are the names of the d inputs. `knots` are the values of each input between which the model is linear, or
    None. `direction` (d,) is the direction of the integration lines in the space of the standard normals, for a model
    without knots; by default it is chosen for each candidate. On a `lattice`, if any, the gradient is summed instead of
    integrated along lines. Raises `InvalidValue`.
    """

    model: ShiftingTimeModel
    conditions: Any
    measured_time: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    axes: tuple[str, ...]
    knots: Knots | None = None
    direction: np.ndarray | None = None
    lattice: Lattice | None = None
    unit: str = "s"
    output_std_bounds: tuple[float, float] = (0.0005, 0.1)

    def __post_init__(self) -> None:
        """Check the shapes, and that the measured times are finite."""
        if not self.lower.shape == self.upper.shape == (len(self.axes),):
            raise InvalidValue(f"There are {len(self.axes)} axes for {len(self.lower)} lower and {len(self.upper)} "
                               "upper bounds", "Give a lower bound, an upper bound and a name for each input")
        if self.measured_time.ndim != 1 or not np.all(np.isfinite(self.measured_time)):
            raise InvalidValue("The measured times are not one finite number per condition",
                               "Leave out the conditions without a measured shifting time")

    def require_output_std(self, output_std: float) -> None:
        """Raise `InvalidValue` if the output noise is less than the rounding errors of the measured times."""
        least = _RESOLUTION * float(np.max(np.abs(self.measured_time), initial=0.0))
        if output_std < least:
            raise InvalidValue(f"The output std is {output_std:.4g} {self.unit}, less than the rounding errors of the "
                               "measurements", f"Give more, such as {10 * least:.1g} {self.unit}")


@dataclass(frozen=True, eq=False)
class Candidate:
    """Inputs and the std of the additive output noise, in the unit of the output. Raises `InvalidValue`."""

    inputs: Inputs
    output_std: float

    def __post_init__(self) -> None:
        """Check the output std; without noise the density is undefined."""
        if not _LEAST_NOISE <= self.output_std <= _MOST_NOISE:
            raise InvalidValue(f"The output std is {self.output_std}",
                               f"Give a number from {_LEAST_NOISE:g} to {_MOST_NOISE:g}, in the unit of the output")
