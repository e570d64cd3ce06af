"""An axis of a table: multipliers of the nominal value of one parameter."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.errors import InvalidValue, quoted


@dataclass(frozen=True, eq=False)
class Axis:
    """Increasing multipliers `values` (g,) of `nominal`, the value of the parameter `name` in `unit`.

    Raises `InvalidValue` if there are fewer than two values, or if they do not increase or are not finite.
    """

    name: str
    values: np.ndarray
    nominal: float
    unit: str

    def __post_init__(self) -> None:
        """Check the properties on which the interpolation relies."""
        values = self.values
        if values.ndim != 1 or len(values) < 2:
            raise InvalidValue(f"The axis {quoted(self.name)} has {values.size} value(s)", "Give at least two")
        if not (np.all(np.isfinite(values)) and np.all(np.diff(values) > 0) and np.isfinite(self.nominal)):
            raise InvalidValue(f"The values of the axis {quoted(self.name)} do not increase or are not finite",
                               "Give finite multipliers in increasing order, each once")

    @property
    def lower(self) -> float:
        """Smallest multiplier."""
        return float(self.values[0])

    @property
    def upper(self) -> float:
        """Largest multiplier."""
        return float(self.values[-1])


def box(axes: Sequence[Axis]) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest multiplier of each axis, two arrays of shape (d,)."""
    return np.array([axis.lower for axis in axes]), np.array([axis.upper for axis in axes])
