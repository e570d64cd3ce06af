"""What a likelihood is computed for: a model of shifting times, the measured times, and candidate inputs."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood.line_rules import Knots

_LEAST_NOISE, _MOST_NOISE = 1e-15, 1e6  # s: the square of any other may vanish or overflow


class ShiftingTimeModel(Protocol):
    """All this package knows of a model: points (m, d), multiples of nominal -> shifting times (m, n), s.

    A time is NaN where the engagement does not lock.
    """

    def __call__(self, points: np.ndarray, conditions: Any, /) -> np.ndarray:
        """Shifting times of all conditions at all points."""


@dataclass(frozen=True, eq=False)
class InferenceProblem:
    """A model, conditions, their measured times (n,) in s, and the box `lower`, `upper` (d,) the model covers.

    `axes` names the d inputs in what is said of them. `knots`, where the model has any, are the values of each input
    between which it is linear. `direction` (d,) is that of the lines through the standard normals along which a model
    without knots is integrated; by itself it follows the candidate. Raises `InvalidValue`.
    """

    model: ShiftingTimeModel
    conditions: Any
    measured_time: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    axes: tuple[str, ...]
    knots: Knots | None = None
    direction: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Refuse what would make every likelihood NaN."""
        if not self.lower.shape == self.upper.shape == (len(self.axes),):
            raise InvalidValue(f"There are {len(self.axes)} axes for a box of {len(self.lower)} and {len(self.upper)}",
                               "Give lower, upper and a name for each input")
        if self.measured_time.ndim != 1 or not np.all(np.isfinite(self.measured_time)):
            raise InvalidValue("The measured times are not one finite number a condition",
                               "Leave out the conditions without a measured shifting time")


@dataclass(frozen=True, eq=False)
class Candidate:
    """Inputs and the std of the additive output noise in s, from 1e-15 to 1e6; raises `InvalidValue` on others."""

    inputs: Inputs
    output_std: float

    def __post_init__(self) -> None:
        """Without noise the samples have no density at a given time."""
        if not _LEAST_NOISE <= self.output_std <= _MOST_NOISE:
            raise InvalidValue(f"The output std is {self.output_std} s",
                               f"Give a number of seconds from {_LEAST_NOISE:g} to {_MOST_NOISE:g}")
