"""Wall time and processor time of each stage of a long computation."""

import time
from collections.abc import Mapping
from typing import Any

ClockTimes = tuple[float, float]


def clock_times() -> ClockTimes:
    """Wall time, and processor time of all threads of this process, both in s."""
    return time.perf_counter(), time.process_time()


def stage_times(checkpoint: Mapping[str, Any], stage: str, begin: ClockTimes) -> dict[str, dict[str, float]]:
    """The `seconds` and `processor_seconds` by stage of `checkpoint`, with the time since `begin` added to `stage`."""
    updated = {}
    for name, start, now in zip(("seconds", "processor_seconds"), begin, clock_times(), strict=True):
        previous: dict[str, float] = checkpoint.get(name, {})
        updated[name] = {**previous, stage: previous.get(stage, 0.0) + now - start}
    return updated
