"""The settings of a study, as JSON. One default for all recordings."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from slipstick.bench import parameters
from slipstick.clutch import effects
from slipstick.errors import InvalidValue, UnknownName
from slipstick.study.design import WIDEST


@dataclass(frozen=True)
class StudySettings:
    """What moves, what is tried, and when something is called missing; raises `InvalidValue`, `UnknownName`.

    `parameters` are fitted together with every candidate, those of `scatter` also vary from run to run, by a standard
    deviation of at most `widest_scatter` of their nominal value: what asks for more is missing. `catalogue` names the
    effects to try, all by default. A screening goes on to fit the candidates whose p-value is at most `significance`
    and whose signature is `smallest` noise levels or more, `shortlist` of them. `shifting_time_noise` is the standard
    deviation of that measurement in s, `level` that of intervals.
    """

    seed: int = 1
    parameters: tuple[str, ...] = (*parameters.UNCERTAIN, "film_coefficient")
    scatter: tuple[str, ...] = ("pressure_bias", "initial_position")
    widest_scatter: float = WIDEST
    catalogue: tuple[str, ...] = tuple(effect.name for effect in effects.CATALOGUE if effect.listed)
    shortlist: int = 5
    most_effects: int = 3
    significance: float = 0.01
    smallest: float = 0.02
    shifting_time_noise: float = 3e-3
    level: float = 0.9

    def __post_init__(self) -> None:
        """Refuse what would fail later, or try nothing."""
        for name in ("parameters", "scatter", "catalogue"):
            if isinstance(getattr(self, name), str):
                raise InvalidValue(f"{name} is '{getattr(self, name)}'", "Give a list of names")
        for name in self.parameters:
            parameters.index(name)
        for name in self.catalogue:
            effects.find(name)
        for name in self.scatter:
            if name not in self.parameters:
                raise UnknownName.of("fitted parameter", name, self.parameters)
        for name in ("parameters", "scatter", "catalogue"):
            if not getattr(self, name) or len(set(getattr(self, name))) < len(getattr(self, name)):
                raise InvalidValue(f"{name} is {list(getattr(self, name))}", "Name one or more, each once")
        for name, least in (("seed", 0), ("shortlist", 1), ("most_effects", 1), ("smallest", 0)):
            if name != "smallest" and not isinstance(getattr(self, name), int):
                raise InvalidValue(f"{name} is {getattr(self, name)!r}", "Give a whole number")
            if not getattr(self, name) >= least:
                raise InvalidValue(f"{name} is {getattr(self, name)}", f"Give at least {least}")
        for name in ("significance", "level", "widest_scatter"):
            if not 0 < getattr(self, name) < 1:
                raise InvalidValue(f"{name} is {getattr(self, name)}", "Give a number between 0 and 1")
        if not 0 < self.shifting_time_noise < 1:
            raise InvalidValue(f"shifting_time_noise is {self.shifting_time_noise} s", "Give seconds, such as 0.003")

    @property
    def scattering(self) -> tuple[int, ...]:
        """Where the scattering parameters stand among the fitted ones."""
        return tuple(self.parameters.index(name) for name in self.scatter)

    @property
    def digest(self) -> str:
        """SHA-256 of all settings."""
        return hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "StudySettings":
        """Settings from JSON, where tuples are lists; raises `UnknownName`."""
        known = [field.name for field in fields(cls)]
        for name in values:
            if name not in known:
                raise UnknownName.of("setting", name, known)
        given: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value
                                 for name, value in values.items()}
        return cls(**given)
