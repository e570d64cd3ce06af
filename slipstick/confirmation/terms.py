"""What a confirmation adds to the model: effects of the catalogue with free coefficients, or measured laws."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.bench import Bench
from slipstick.clutch import effects
from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model

_MOST = 3.0
"""Largest multiple of a measured law that is tried: it was measured, so that about 1 is expected."""


@dataclass(frozen=True)
class Unknown:
    """A coefficient of a term: `name`, `unit`, bounds, where it does nothing (`neutral`), and a `typical` value."""

    term: str
    name: str
    unit: str
    neutral: float
    lower: float
    upper: float
    typical: float

    @property
    def span(self) -> float:
        """The width of its bounds, which is the unit of the fit."""
        return self.upper - self.lower


@dataclass(frozen=True)
class Terms:
    """The `effects` (names of the catalogue) and measured `laws` that are added to the model of a `bench`."""

    bench: Bench
    effects: tuple[str, ...] = ()
    laws: tuple[MeasuredLaw, ...] = ()

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """The coefficients of all effects, then a factor for each law."""
        unknowns = []
        for name in self.effects:
            for coefficient in effects.find(name).on(self.bench.scales).coefficients:
                # A shape coefficient with a single admissible value does not move.
                neutral = coefficient.typical if coefficient.shape else coefficient.neutral
                unknowns.append(Unknown(name, coefficient.name, coefficient.unit, neutral, coefficient.lower,
                                        coefficient.upper, coefficient.typical))
        for law in self.laws:
            unknowns.append(Unknown(f"{law.quantity} ~ {law.depends_on}", "factor", "1", 0.0, -_MOST, _MOST, 1.0))
        return tuple(unknowns)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the effects, and of the laws as `quantity ~ dependence`."""
        return *self.effects, *(f"{law.quantity} ~ {law.depends_on}" for law in self.laws)

    def only(self, names: Collection[str]) -> "Terms":
        """Those of these names."""
        return replace(self, effects=tuple(name for name in self.effects if name in names),
                       laws=tuple(law for law in self.laws if f"{law.quantity} ~ {law.depends_on}" in names))

    def coefficients(self, values: Sequence[float] | np.ndarray) -> np.ndarray:
        """The coefficient vector (c,) of the simulator for `values` (p,) of the unknowns."""
        vector = effects.neutral()
        for unknown, value in zip(self.unknowns, values, strict=True):
            if unknown.term in self.effects:
                vector[effects.index(unknown.term, unknown.name)] = value
        return vector

    def scaled(self, values: Sequence[float] | np.ndarray) -> tuple[MeasuredLaw, ...]:
        """The laws times their factors."""
        factors = np.asarray(values)[len(self.unknowns) - len(self.laws):]
        return tuple(replace(law, change=tuple(float(factor) * change for change in law.change))
                     for law, factor in zip(self.laws, factors, strict=True))

    def model(self, values: Sequence[float] | np.ndarray, parameters: tuple[float, ...] = ()) -> Model:
        """The model with these `values`, and `parameters` (20,) or those of the bench."""
        named: dict[str, dict[str, float]] = {name: {} for name in self.effects}
        for unknown, value in zip(self.unknowns, values, strict=True):
            if unknown.term in named:
                named[unknown.term][unknown.name] = float(value)
        return Model(self.bench.physics, parameters, named, self.scaled(values))
