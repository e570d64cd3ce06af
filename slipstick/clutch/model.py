"""An immutable model: 20 parameters, and the coefficients of the effects added to the paper's equations."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from slipstick.clutch import converter, effects, parameters
from slipstick.clutch.effects.effect import Effect
from slipstick.errors import InvalidValue


@dataclass(frozen=True)
class Model:
    """`parameters` in the order and units of `PARAMETERS`; `effects` maps effect -> coefficient -> value.

    The coefficients of all other effects are neutral. Raises `InvalidValue` for values that are not finite, and
    `UnknownName` for an effect or coefficient that is not in the catalogue.
    """

    parameters: tuple[float, ...] = tuple(parameters.nominal().tolist())
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Validate the number, names and finiteness of the values."""
        if len(self.parameters) != len(parameters.NAMES):
            raise InvalidValue(f"A model has {len(parameters.NAMES)} parameters, not {len(self.parameters)}",
                               "Start from Model() and change values with `with_parameters`")
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
        """The model as JSON: parameters with units, effects, and the converter curves."""
        units = {parameter.name: parameter.unit for parameter in parameters.PARAMETERS}
        return {
            "parameters": dict(zip(parameters.NAMES, self.parameters, strict=True)),
            "units": units,
            "effects": {name: dict(values) for name, values in sorted(self.effects.items())},
            "torque_converter": converter.spec(),
        }

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> "Model":
        """The model of a `spec()`; raises `InvalidValue` if its converter curves are not those of this version."""
        if spec.get("torque_converter") != converter.spec():
            raise InvalidValue("The model was computed with other torque converter curves",
                               "Rebuild it with the curves of this version")
        return cls(effects=spec["effects"]).with_parameters(spec["parameters"])

    @property
    def digest(self) -> str:
        """SHA-256 of the spec. Models with equal digests are equal."""
        return hashlib.sha256(json.dumps(self.spec(), sort_keys=True).encode()).hexdigest()
