"""The constants that decide what is named."""

from dataclasses import dataclass
from typing import Any, ClassVar


@dataclass(frozen=True)
class EngineSettings:
    """What a law must show to be named."""

    __pydantic_config__: ClassVar[dict[str, Any]] = {"use_attribute_docstrings": True, "extra": "forbid"}

    nats: float = 12.0
    """Least gain in log marginal likelihood. With 70 candidates, a Bayes factor of e^12 leaves odds of 2000 to 1."""
    errors: float = 4.0
    """Least agreement of the runs, in standard errors: gains held out in each run over those expected there."""
    apart: float = 2.5
    """Standard errors by which a law leads another one, and half of whose square it leads in nats, or both are reported
    as a tie."""
    further: float = 0.03
    """Share of what the first law of a part has gained that a further one must gain: what a law leaves of the first is
    not another one."""
    most: int = 3
    """Most laws."""
    rivals: int = 3
    """Candidates that are fitted in full in a round."""
    outlying: float = 6.0
    """Robust standard deviations beyond which a run is set aside, by the logarithm of its chi-square or a parameter."""
    most_outlying: float = 0.1
    """Largest share of runs that may be set aside before laws are searched. More may be something to name."""
    least_spread: float = 0.15
    """Standard deviation of the logarithm of chi-square that good runs have at least."""
    unexplained: float = 0.2
    """Share by which the chi-square of a part may exceed 1 where nothing is missing: no model leaves nothing."""
