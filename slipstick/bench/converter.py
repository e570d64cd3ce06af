"""The torque converter of eq. 3: torque ratio f_st and capacity factor f_sk over the speed ratio."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from slipstick.errors import InvalidValue

CAPACITY_UNIT = "rad/s/(N m)^0.5"
MOST_POINTS = 200
MOST_TERMS = 7 + 3 * (MOST_POINTS + 1)
"""Largest length of `Converter.terms`."""


@dataclass(frozen=True)
class Converter:
    """Curves of k points each: rising `speed_ratio`, `torque_ratio`, and `capacity_factor` in rad/s/(N m)^0.5.

    They are linear between the points and constant outside. Raises `InvalidValue`.
    """

    speed_ratio: tuple[float, ...]
    torque_ratio: tuple[float, ...]
    capacity_factor: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check lengths, order and signs once."""
        lengths = {len(self.speed_ratio), len(self.torque_ratio), len(self.capacity_factor)}
        if len(lengths) > 1 or not 2 <= len(self.speed_ratio) <= MOST_POINTS:
            raise InvalidValue(f"The converter curves have {len(self.speed_ratio)}, {len(self.torque_ratio)} and "
                               f"{len(self.capacity_factor)} points",
                               f"Give 2 to {MOST_POINTS} speed ratios, and as many values of both curves")
        if not np.all(np.isfinite([self.speed_ratio, self.torque_ratio, self.capacity_factor])):
            raise InvalidValue("A point of the converter curves is not finite", "Give finite numbers")
        if np.any(np.diff(self.speed_ratio) <= 0):
            raise InvalidValue("The speed ratios of the converter do not rise",
                               "Sort the points, each speed ratio once")
        if min(self.torque_ratio) < 0 or min(self.capacity_factor) <= 0:
            raise InvalidValue("A torque ratio is negative, or a capacity factor is not positive",
                               "Check the curves: torque = (motor speed / capacity factor)^2 torque ratio")

    def torque(self, input_speed: float, motor_speed: float) -> float:
        """Output torque in N m at both speeds in rad/s: motor_speed^2 f_st / f_sk^2."""
        ratio = input_speed / motor_speed
        torque_ratio = float(np.interp(ratio, self.speed_ratio, self.torque_ratio))
        return torque_ratio * (motor_speed / float(np.interp(ratio, self.speed_ratio, self.capacity_factor))) ** 2

    @cached_property
    def terms(self) -> np.ndarray:
        """Both curves as a line and hinges max(0, ratio - position), for the compiled simulator: shape (7 + 12 g,).

        Number of groups g of four hinges; first and last speed ratio; value and slope at the first of torque ratio and
        capacity factor; then position and changes of both slopes, hinge after hinge.
        """
        ratio = np.array(self.speed_ratio)
        slopes = [np.diff(curve) / np.diff(ratio) for curve in (self.torque_ratio, self.capacity_factor)]
        hinges = np.column_stack([ratio[1:-1], *(np.diff(slope) for slope in slopes)])
        hinges = np.concatenate([hinges, np.zeros((-len(hinges) % 4, 3))])
        return np.array([len(hinges) // 4, ratio[0], ratio[-1], self.torque_ratio[0], slopes[0][0],
                         self.capacity_factor[0], slopes[1][0], *hinges.ravel()])

    def spec(self) -> dict[str, list[float]]:
        """The curves as JSON."""
        return {"speed_ratio": list(self.speed_ratio), "torque_ratio": list(self.torque_ratio),
                "capacity_factor": list(self.capacity_factor)}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> "Converter":
        """Rebuild what `spec` wrote; raises `InvalidValue`."""
        return cls(*(tuple(float(value) for value in spec[name])
                     for name in ("speed_ratio", "torque_ratio", "capacity_factor")))


NO_CONVERTER = Converter((0.0, 1.0), (0.0, 0.0), (1.0, 1.0))
"""The curves of a bench without a converter: no torque beside the given input torque."""
