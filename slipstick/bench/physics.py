"""The physics of a bench: the nominal values of the model's parameters and the torque converter."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from slipstick.bench import parameters
from slipstick.bench.converter import NO_CONVERTER, Converter
from slipstick.errors import InvalidValue


@dataclass(frozen=True)
class Physics:
    """`nominal` values in the order and units of `PARAMETERS`, and the `converter`; None for a given input torque.

    Raises `InvalidValue`.
    """

    nominal: tuple[float, ...]
    converter: Converter | None

    def __post_init__(self) -> None:
        """Check number and finiteness once."""
        if len(self.nominal) != len(parameters.NAMES) or not np.all(np.isfinite(self.nominal)):
            raise InvalidValue(f"The nominal values are not {len(parameters.NAMES)} finite numbers",
                               f"Give one for each of {', '.join(parameters.NAMES)}")

    @property
    def curves(self) -> Converter:
        """The converter curves to simulate with: those of no torque on a bench without a converter."""
        return self.converter or NO_CONVERTER

    def spec(self) -> dict[str, Any]:
        """The physics as JSON."""
        return {"parameters": dict(zip(parameters.NAMES, self.nominal, strict=True)),
                "torque_converter": None if self.converter is None else self.converter.spec()}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> "Physics":
        """Rebuild what `spec` wrote; raises `InvalidValue`."""
        converter = spec["torque_converter"]
        return cls(tuple(float(spec["parameters"][name]) for name in parameters.NAMES),
                   None if converter is None else Converter.from_spec(converter))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the spec: benches with the same digest have the same physics."""
        return hashlib.sha256(json.dumps(self.spec(), sort_keys=True).encode()).hexdigest()
