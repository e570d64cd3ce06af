"""The settings of a fit, as JSON."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal, get_args

import numpy as np

from slipstick.errors import InvalidValue, UnknownName, require_whole
from slipstick.uncertainty.chaos.expansion import ExpansionSettings, Rule
from slipstick.uncertainty.chaos.families import FAMILIES, LARGEST
from slipstick.uncertainty.likelihood.likelihood import SAMPLES

Bounds = tuple[float, float]
Method = Literal["genetic", "classic"]
METHODS: tuple[Method, ...] = get_args(Method)
Integration = Literal["lines", "sampling"]
INTEGRATIONS: tuple[Integration, ...] = get_args(Integration)
_LEAST_STD = 1e-9
"""Smallest bound of a std in multiples of nominal: a billionth scatters nothing, and squares of far less underflow."""
_ORDERS, _LOWEST_ORDER = {1: 4, 2: 4, 3: 3, 4: 3, 5: 3}, 2
"""Orders of a search by the number of inputs. It only has to reach the maximum that the refinement then climbs, at the
fewest runs of the model: (order + 1)^2 for two inputs (docs/uncertainty.md)."""


@dataclass(frozen=True)
class FitSettings:
    """Unknowns, bounds and method of a maximum-likelihood fit. Raises `InvalidValue`, `UnknownName`.

    The unknowns are mean and std of each input, the output std and, with `correlated`, the correlations of the inputs.
    `families`, `mean_bounds` and `std_bounds` (multiples of nominal) contain one entry for all inputs, or one entry per
    input. `output_std_bounds` are in the unit of the output, s for shifting times; None selects those of the problem.

    The `method` "genetic" evaluates `population` candidates per generation, for at most `generations` generations. It
    stops early if `patience` generations improve the likelihood by no more than `tolerance` decades; the refinement
    gains the rest, and a fit without it needs 0.1 to come closer. It uses the likelihood by expansion. `order`, `norm`,
    `rule`, `nodes` and the number of samples `runs` are those of expansion.py; None selects a default for the number of
    inputs. The `integration` is along "lines", or by "sampling" with `samples` (a power of two) as in the paper.

    The method "classic" evaluates a grid with `grid` values per unknown, by samples of the model. With `refine`, the
    best candidate of either method is refined on the exact likelihood. With `intervals`, profile-likelihood intervals
    of confidence `level` are computed.
    """

    seed: int = 1
    families: tuple[str, ...] = ("normal",)
    correlated: bool = False
    mean_bounds: tuple[Bounds, ...] = ((0.5, 1.5),)
    std_bounds: tuple[Bounds, ...] = ((0.002, 0.3),)
    output_std_bounds: Bounds | None = None
    method: Method = "genetic"
    population: int = 40
    generations: int = 80
    patience: int = 10
    tolerance: float = 1.0
    order: int | None = None
    norm: float = 1.0
    rule: Rule | None = None
    nodes: int | None = None
    runs: int | None = None
    integration: Integration = "lines"
    samples: int = SAMPLES
    grid: int = 8
    refine: bool = True
    intervals: bool = True
    level: float = 0.9

    def __post_init__(self) -> None:
        """Check the settings."""
        require_whole(seed=self.seed, population=self.population, generations=self.generations, patience=self.patience,
                      order=self.order, nodes=self.nodes, runs=self.runs, samples=self.samples, grid=self.grid)
        for name, least in (("seed", 0), ("population", 4), ("generations", 1), ("patience", 1), ("tolerance", 0),
                            ("grid", 2)):
            if not getattr(self, name) >= least:
                raise InvalidValue(f"{name} is {getattr(self, name)}", f"Give at least {least}")
        for name, known in (("method", METHODS), ("integration", INTEGRATIONS)):
            if getattr(self, name) not in known:
                raise UnknownName.of(name, getattr(self, name), known)
        for family in self.families:
            if family not in FAMILIES:
                raise UnknownName.of("family", family, FAMILIES)
        if self.samples < 1 or self.samples & (self.samples - 1):
            raise InvalidValue(f"samples is {self.samples}, which is not a power of two",
                               "Take 1024, 2048, 4096 and so on")
        of_output = () if self.output_std_bounds is None else (self.output_std_bounds,)
        for bounds in (*self.mean_bounds, *self.std_bounds, *of_output):
            if not (len(bounds) == 2 and np.all(np.isfinite(bounds)) and bounds[0] < bounds[1]):
                raise InvalidValue(f"The bounds {bounds} are not a finite range",
                                   "Give (lower, upper), the smaller value first")
        if min(low for low, _ in (*self.std_bounds, *of_output)) <= 0:
            raise InvalidValue("A lower bound of a std is 0 or negative",
                               "Give a positive lower bound, because stds are searched on a log scale")
        if any(low < _LEAST_STD or high > LARGEST for low, high in self.std_bounds):
            raise InvalidValue("A bound of a std is too small or too large to be searched",
                               f"Give bounds from {_LEAST_STD:g} to {LARGEST:g} multiples of nominal")
        if not 0 < self.level < 1:
            raise InvalidValue(f"The level of the intervals is {self.level}", "Give a probability, such as 0.9")

    def expansion(self, dimension: int) -> ExpansionSettings:
        """The settings of the expansions of a search over d inputs, without error estimates."""
        order = self.order if self.order is not None else _ORDERS.get(dimension, _LOWEST_ORDER)
        return ExpansionSettings(order, self.norm, self.rule, self.nodes, 0, self.runs)

    def to_dict(self) -> dict[str, Any]:
        """The settings as JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "FitSettings":
        """The settings from JSON; missing entries have their defaults. Raises `UnknownName` for an unknown setting."""
        known = [field.name for field in fields(cls)]
        for name in values:
            if name not in known:
                raise UnknownName.of("fit setting", name, known)
        return cls(**{name: _to_tuples(value) for name, value in values.items()})


def _to_tuples(value: Any) -> Any:
    return tuple(_to_tuples(entry) for entry in value) if isinstance(value, list | tuple) else value
