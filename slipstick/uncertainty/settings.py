"""The settings of a fit, as JSON."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from slipstick.errors import InvalidValue, UnknownName
from slipstick.uncertainty.expansion import NODES, ORDER
from slipstick.uncertainty.likelihood import SAMPLES

Bounds = tuple[float, float]


@dataclass(frozen=True)
class FitSettings:
    """How to search for the means, stds and output std of greatest likelihood; raises `InvalidValue`.

    `population` candidates a generation, at most `generations` of them, fewer after `patience` generations that
    gain no more than `tolerance` decades. `order` and `nodes` (an axis) make the expansion, `samples` germs (a power
    of two) the mean of normal densities. `polish` ends the fit on the model itself, without the expansion.
    `mean_bounds` and `std_bounds`, multiples of nominal, hold one pair for all inputs or one each;
    `output_std_bounds` are in s.
    """

    seed: int = 1
    population: int = 40
    generations: int = 80
    patience: int = 20
    tolerance: float = 0.01
    order: int = ORDER
    nodes: int = NODES
    samples: int = SAMPLES
    polish: bool = True
    mean_bounds: tuple[Bounds, ...] = ((0.5, 1.5),)
    std_bounds: tuple[Bounds, ...] = ((0.002, 0.3),)
    output_std_bounds: Bounds = (0.0005, 0.1)

    def __post_init__(self) -> None:
        """Refuse what would fail later, or search nothing."""
        for name, least in (("seed", 0), ("population", 4), ("generations", 1), ("patience", 1), ("tolerance", 0)):
            if not getattr(self, name) >= least:
                raise InvalidValue(f"{name} is {getattr(self, name)}", f"Give at least {least}")
        if self.samples < 1 or self.samples & (self.samples - 1):
            raise InvalidValue(f"samples is {self.samples}, no power of two", "Take 1024, 2048, 4096 and so on")
        if self.nodes <= self.order:
            raise InvalidValue(f"{self.nodes} nodes an axis are too few for order {self.order}",
                               f"Take at least {self.order + 1} nodes")
        for bounds in (*self.mean_bounds, *self.std_bounds, self.output_std_bounds):
            if not (len(bounds) == 2 and np.all(np.isfinite(bounds)) and bounds[0] < bounds[1]):
                raise InvalidValue(f"The bounds {bounds} are no finite range", "Give (lower, upper), lower first")
        if min(low for low, _ in (*self.std_bounds, self.output_std_bounds)) <= 0:
            raise InvalidValue("A std may be 0 or less", "Give stds a positive lower bound: they are searched in logs")

    def to_dict(self) -> dict[str, Any]:
        """The settings as JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "FitSettings":
        """Rebuild from JSON; what is left out has its default. Raises `UnknownName` on a setting there is not."""
        known = [field.name for field in fields(cls)]
        for name in values:
            if name not in known:
                raise UnknownName.of("fit setting", name, known)
        return cls(**{name: _tuples(value) for name, value in values.items()})


def _tuples(value: Any) -> Any:
    return tuple(_tuples(entry) for entry in value) if isinstance(value, list | tuple) else value
