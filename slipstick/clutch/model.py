"""An immutable model: a bench, 20 parameters, and the coefficients of the effects added to the paper's equations."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from slipstick.bench import parameters
from slipstick.bench.converter import Converter
from slipstick.bench.physics import Physics
from slipstick.clutch import effects
from slipstick.clutch.effects.effect import Effect
from slipstick.errors import InvalidValue


@dataclass(frozen=True)
class Model:
    """The `physics` of a bench, `parameters` and `effects`, which maps effect -> coefficient -> value.

    `parameters` are in the order and units of `PARAMETERS`; without them the model has the nominal ones of the bench.
    The coefficients of all other effects are neutral. Raises `InvalidValue` for values that are not finite, and
    `UnknownName` for an effect or coefficient that is not in the catalogue.
    """

    physics: Physics
    parameters: tuple[float, ...] = ()
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Validate the number, names and finiteness of the values."""
        if not self.parameters:
            object.__setattr__(self, "parameters", self.physics.nominal)
        if len(self.parameters) != len(parameters.NAMES):
            raise InvalidValue(f"A model has {len(parameters.NAMES)} parameters, not {len(self.parameters)}",
                               "Start from Model(physics) and change values with `with_parameters`")
        values = (*self.parameters, *self.coefficients())
        if not np.all(np.isfinite(values)):
            raise InvalidValue("A parameter or coefficient is not finite", "Give finite numbers")

    def with_parameters(self, values: Mapping[str, float]) -> "Model":
        """A copy of this model with the named parameters replaced (in their units)."""
        vector = list(self.parameters)
        for name, value in values.items():
            vector[parameters.index(name)] = float(value)
        return replace(self, parameters=tuple(vector))

    def with_effect(self, name: str, coefficients: Mapping[str, float]) -> "Model":
        """A copy of this model with the effect `name` at `coefficients`; its other coefficients are neutral."""
        return replace(self, effects={**self.effects, name: dict(coefficients)})

    @property
    def nominal(self) -> np.ndarray:
        """Nominal values of the bench, shape (20,), in the units of `PARAMETERS`."""
        return np.array(self.physics.nominal)

    @property
    def converter(self) -> Converter:
        """The torque converter of the bench."""
        return self.physics.curves

    def coefficients(self) -> np.ndarray:
        """All coefficients in catalogue order, neutral unless set in the model: shape (c,)."""
        vector = effects.neutral()
        for name, values in self.effects.items():
            effects.find(name)
            for coefficient, value in values.items():
                vector[effects.index(name, coefficient)] = float(value)
        return vector

    def coefficients_of(self, effect: Effect) -> tuple[float, ...]:
        """The coefficients of one effect, in their order."""
        return tuple(self.coefficients()[effects.span(effect)].tolist())

    @property
    def uses_run_order(self) -> bool:
        """Whether an effect that is not neutral depends on the run order."""
        return any(effect.uses_run_order and self.coefficients_of(effect) != effect.neutral
                   for effect in effects.CATALOGUE)

    def spec(self) -> dict[str, Any]:
        """The model as JSON: parameters with units, effects, and the physics of the bench with its digest."""
        units = {parameter.name: parameter.unit for parameter in parameters.PARAMETERS}
        return {
            "parameters": dict(zip(parameters.NAMES, self.parameters, strict=True)),
            "units": units,
            "effects": {name: dict(values) for name, values in sorted(self.effects.items())},
            "bench": {**self.physics.spec(), "digest": self.physics.digest},
        }

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> "Model":
        """The model of a `spec()`; raises `InvalidValue` if its bench does not have the digest it states."""
        physics = Physics.from_spec(spec["bench"])
        if physics.digest != spec["bench"]["digest"]:
            raise InvalidValue("The bench of the model was changed: its digest does not match",
                               "Restore the file, or build the model again from its bench")
        return cls(physics, effects=spec["effects"]).with_parameters(spec["parameters"])

    @property
    def digest(self) -> str:
        """SHA-256 of the spec: equal digests mean equal specs."""
        return hashlib.sha256(json.dumps(self.spec(), sort_keys=True).encode()).hexdigest()
