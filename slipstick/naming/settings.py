"""The constants that decide what is named, and their digest."""

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

from slipstick.errors import InvalidValue


@dataclass(frozen=True)
class NamingSettings:
    """What a pair of quantity and dependence must show to be named; raises `InvalidValue`."""

    __pydantic_config__: ClassVar[dict[str, Any]] = {"use_attribute_docstrings": True, "extra": "forbid"}

    nats: float = 12.0
    """Least gain in natural log-likelihood. One odd engagement can give nats: `errors` is required as well."""
    errors: float = 4.0
    """Least gain in standard errors of its signed roots over engagements. With 60 pairs tried, Student's distribution
    of 53 degrees of freedom exceeds 3.8 once in a hundred sets of 54 recordings."""
    apart: float = 2.5
    """Standard errors by which the best pair must lead another one, or both are reported as a tie."""
    further: float = 0.03
    """Share of what the first pair of a block explains that a further one must add. Less may be no more than what a
    free law with few knots leaves of the first."""
    most: int = 3
    """Pairs named in a block at most."""
    rivals: int = 3
    """Pairs fitted in full beside the best one."""
    strong: float = 2.0
    """Reduced chi-square of a block without laws from which its laws have 17 knots instead of 9."""
    outlying: float = 6.0
    """Robust standard deviations of the logarithm of chi-square beyond which an engagement is set aside."""
    most_outlying: float = 0.1
    """Largest share of engagements that may be set aside. More is no accident, but something to name."""
    noise: float = 0.05
    """Standard error of the logarithm of a sensor's estimated noise variance, by which the chi-square of all
    engagements may be off: the root mean square of the logarithm of chi-square is 0.05 over the blocks of the 15
    development cases without an effect. A block whose chi-square exceeds 1 by more than `errors` standard errors, this
    one included, is not explained."""

    def __post_init__(self) -> None:
        """Refuse what cannot decide anything."""
        for name, value in asdict(self).items():
            if not value >= 0:
                raise InvalidValue(f"{name} is {value}", "Give a number that is not negative")
        if self.most_outlying >= 0.5:
            raise InvalidValue(f"most_outlying is {self.most_outlying}", "Give less than half of the engagements")

    @property
    def digest(self) -> str:
        """SHA-256 of all settings and of the method."""
        return digest_of(self, "blocks", "naming")


def digest_of(settings: Any, *packages: str) -> str:
    """SHA-256 of the fields of `settings`, and of the source of these packages of slipstick.

    Constants in the source decide as well: equal digests stand for the same method with the same settings.
    """
    hashed = hashlib.sha256(json.dumps(asdict(settings), sort_keys=True).encode())
    for package in packages:
        for path in sorted((Path(__file__).parents[1] / package).glob("*.py")):
            hashed.update(path.read_bytes())
    return hashed.hexdigest()
