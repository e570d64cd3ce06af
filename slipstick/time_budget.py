"""The time budget of a job, and what its result lacks if that ended before the job was complete.

A result is complete or partial. A complete one is the same whatever the budget was; a partial one depends on the clock.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from slipstick.errors import SlipstickError

DEFAULT = 86_400.0
"""Time budget in s where none is given: a day, so that a job that does not end does not hold its worker for ever."""


class TimeBudgetEnded(SlipstickError):
    """The time budget of a job ended before it had anything to show."""

    @classmethod
    def before(cls, budget: float, what: str) -> "TimeBudgetEnded":
        """Build the error of a `budget` in s that ended before `what`."""
        return cls(f"The time budget of {budget:g} s ended before {what}", "Give a larger time budget")


@dataclass(frozen=True)
class Partial:
    """What is complete and what is missing, because the time budget ended before the job."""

    __pydantic_config__: ClassVar[dict[str, Any]] = {"use_attribute_docstrings": True}

    budget: float
    """Time budget in s."""
    done: list[str]
    """What is complete, in words."""
    missing: list[str]
    """What is missing, in words."""

    @property
    def warning(self) -> tuple[str, str]:
        """A bold lead-in, and the text after it."""
        return "Partial result:", (f"the time budget of {self.budget:g} s ended before the job. Complete: "
                                   f"{_listed(self.done)}. Missing: {_listed(self.missing)}. What is missing may "
                                   "change the answer: repeat the job with a larger time budget.")


def _listed(words: Sequence[str]) -> str:
    return "; ".join(words) or "nothing"
