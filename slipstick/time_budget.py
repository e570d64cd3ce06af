"""The time of a job by stage, its time budget, and what its result lacks if that ended before the job was complete.

A result is complete or partial. A complete one is the same whatever the budget was; a partial one depends on the clock.
"""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from slipstick.errors import InvalidValue, SlipstickError
from slipstick.numerics.quantities import NotAQuantity, in_unit

ClockTimes = tuple[float, float]
DEFAULT = 86_400.0
"""Time budget in s where none is given: a day, so that a job that does not end does not hold its worker for ever."""


def seconds_of(budget: float | str | None) -> float:
    """A time budget in s, from a number of seconds or a text such as "2 min"; None is the default, infinity none.

    Raises `InvalidValue`.
    """
    if budget is None:
        return DEFAULT
    if budget == math.inf:
        return math.inf
    try:
        seconds = in_unit(budget if isinstance(budget, str) else f"{budget} s", "s")
    except NotAQuantity as error:
        raise InvalidValue(f"The time budget is {budget!r}: {error}", 'Give seconds, or a text such as "2 min"') \
            from None
    if seconds < 0:
        raise InvalidValue(f"The time budget is {budget!r}", "Give 0 s or more")
    return seconds


def clock_times() -> ClockTimes:
    """Wall time, and processor time of all threads of this process, both in s."""
    return time.perf_counter(), time.process_time()


def stage_times(before: Mapping[str, Any], stage: str, begin: ClockTimes) -> dict[str, dict[str, float]]:
    """The `seconds` and `processor_seconds` by stage in `before`, with the time since `begin` added to `stage`."""
    updated = {}
    for name, start, now in zip(("seconds", "processor_seconds"), begin, clock_times(), strict=True):
        previous: dict[str, float] = before.get(name, {})
        updated[name] = {**previous, stage: previous.get(stage, 0.0) + now - start}
    return updated


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
