"""An immutable model: a bench, 20 parameters, the coefficients of effects, and measured laws."""

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
from slipstick.clutch.laws import MOST_LAWS, MeasuredLaw
from slipstick.errors import InvalidValue


@dataclass(frozen=True)
class Model:
    """The `physics` of a bench, `parameters`, `effects` (effect -> coefficient -> value), and measured `laws`.

    `parameters` are in the order and units of `PARAMETERS`; without them the model has the nominal ones of the bench.
    The coefficients of all other effects are neutral. The laws act in their order, after the effects. Raises
    `InvalidValue` for values that are not finite and for too many laws, and `UnknownName` for an effect or coefficient
    that is not in the catalogue.
    """

    physics: Physics
    parameters: tuple[float, ...] = ()
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    laws: tuple[MeasuredLaw, ...] = ()

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
        if len(self.laws) > MOST_LAWS:
            raise InvalidValue(f"A model has at most {MOST_LAWS} measured laws, not {len(self.laws)}",
                               "Leave out the laws that change least, or join laws over the same dependence")

    def with_parameters(self, values: Mapping[str, float]) -> "Model":
        """A copy of this model with the named parameters replaced (in their units)."""
        vector = list(self.parameters)
        for name, value in values.items():
            vector[parameters.index(name)] = float(value)
        return replace(self, parameters=tuple(vector))

    def with_effect(self, name: str, coefficients: Mapping[str, float]) -> "Model":
        """A copy of this model with the effect `name` at `coefficients`; its other coefficients are neutral."""
        return replace(self, effects={**self.effects, name: dict(coefficients)})

    def with_law(self, law: MeasuredLaw) -> "Model":
        """A copy of this model with a measured law after its other laws."""
        return replace(self, laws=(*self.laws, law))

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
        """Whether a measured law, or an effect that is not neutral, depends on the run order."""
        return any(law.depends_on == "run order" for law in self.laws) or any(
            effect.uses_run_order and not effect.is_neutral(self.coefficients_of(effect))
            for effect in effects.CATALOGUE)

    def spec(self) -> dict[str, Any]:
        """The model as JSON: parameters with units, effects, the physics of the bench with its digest, and laws if any.

        A model without laws has the spec, and so the digest, that it had before models could have laws.
        """
        units = {parameter.name: parameter.unit for parameter in parameters.PARAMETERS}
        return {
            "parameters": dict(zip(parameters.NAMES, self.parameters, strict=True)),
            "units": units,
            "effects": {name: dict(values) for name, values in sorted(self.effects.items())},
            "bench": {**self.physics.spec(), "digest": self.physics.digest},
            **({"laws": [law.spec() for law in self.laws]} if self.laws else {}),
        }

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> "Model":
        """The model of a `spec()`; raises `InvalidValue` if its bench does not have the digest it states."""
        physics = Physics.from_spec(spec["bench"])
        if physics.digest != spec["bench"]["digest"]:
            raise InvalidValue("The bench of the model was changed: its digest does not match",
                               "Restore the file, or build the model again from its bench")
        laws = tuple(MeasuredLaw.from_spec(law) for law in spec.get("laws", ()))
        return cls(physics, effects=spec["effects"], laws=laws).with_parameters(spec["parameters"])

    @property
    def digest(self) -> str:
        """SHA-256 of the spec: equal digests mean equal specs."""
        return hashlib.sha256(json.dumps(self.spec(), sort_keys=True).encode()).hexdigest()
