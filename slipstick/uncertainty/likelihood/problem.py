"""The arguments of a likelihood: a model of shifting times, the measured times, and candidate inputs."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood.line_rules import Knots

_LEAST_NOISE, _MOST_NOISE = 1e-15, 1e6  # range of the output std in s whose squares neither underflow nor overflow


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
    """A model, conditions, their measured times (n,) in s, and the domain of the model, the box `lower`, `upper` (d,).

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

    def __post_init__(self) -> None:
        """Check the shapes, and that the measured times are finite."""
        if not self.lower.shape == self.upper.shape == (len(self.axes),):
            raise InvalidValue(f"There are {len(self.axes)} axes for {len(self.lower)} lower and {len(self.upper)} "
                               "upper bounds", "Give a lower bound, an upper bound and a name for each input")
        if self.measured_time.ndim != 1 or not np.all(np.isfinite(self.measured_time)):
            raise InvalidValue("The measured times are not one finite number per condition",
                               "Leave out the conditions without a measured shifting time")


@dataclass(frozen=True, eq=False)
class Candidate:
    """Inputs and the std of the additive output noise in s, from 1e-15 to 1e6. Raises `InvalidValue`."""

    inputs: Inputs
    output_std: float

    def __post_init__(self) -> None:
        """Check the output std; without noise the density is undefined."""
        if not _LEAST_NOISE <= self.output_std <= _MOST_NOISE:
            raise InvalidValue(f"The output std is {self.output_std} s",
                               f"Give a value from {_LEAST_NOISE:g} s to {_MOST_NOISE:g} s")
