"""The settings of a study, as JSON. One default for all recordings."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

from slipstick.clutch import effects
from slipstick.errors import InvalidValue, UnknownName
from slipstick.naming import NamingSettings
from slipstick.naming.settings import digest_of

LARGEST_SEED = 2**53
"""Larger whole numbers are not exact in JSON."""


@dataclass(frozen=True)
class StudySettings:
    """What may be named, and when; raises `InvalidValue`, `UnknownName`."""

    __pydantic_config__: ClassVar[dict[str, Any]] = {"use_attribute_docstrings": True, "extra": "forbid"}

    catalogue: tuple[str, ...] = tuple(effect.name for effect in effects.CATALOGUE)
    """Names of the effects that an answer may contain, by default all: what another one explains is unlisted."""
    level: float = 0.9
    """Confidence level of the intervals and bands."""
    seed: int = 1
    """Seed of folds and bootstrap samples; the same seed gives the same result."""
    naming: NamingSettings = field(default_factory=NamingSettings)
    """The constants that decide what is named."""

    def __post_init__(self) -> None:
        """Refuse what would fail later."""
        if isinstance(self.catalogue, str) or len(set(self.catalogue)) < len(self.catalogue):
            raise InvalidValue(f"catalogue is {self.catalogue!r}", "Give a list of names, each once")
        for name in self.catalogue:
            effects.find(name)
        if not 0 < self.level < 1:
            raise InvalidValue(f"level is {self.level}", "Give a number between 0 and 1")
        if not isinstance(self.seed, int) or not 0 <= self.seed <= LARGEST_SEED:
            raise InvalidValue(f"seed is {self.seed!r}", f"Give a whole number from 0 to {LARGEST_SEED}")

    @property
    def digest(self) -> str:
        """SHA-256 of all settings and of the method."""
        return digest_of(self, "blocks", "naming", "engine", "confirmation", "studies")

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "StudySettings":
        """Settings from JSON, where tuples are lists; raises `UnknownName`."""
        given = dict(values)
        for holder, entries in ((cls, given), (NamingSettings, given.get("naming", {}))):
            known = [setting.name for setting in fields(holder)]
            for name in entries:
                if name not in known:
                    raise UnknownName.of("setting", name, known)
        if "naming" in given:
            given["naming"] = NamingSettings(**given["naming"])
        if isinstance(given.get("catalogue"), list):
            given["catalogue"] = tuple(given["catalogue"])
        return cls(**given)
