"""The time that each stage of a long computation took, by the wall and of all threads."""

import time
from collections.abc import Mapping
from typing import Any

Clocks = tuple[float, float]


def clocks() -> Clocks:
    """Of the wall, and of all threads of this process, in s."""
    return time.perf_counter(), time.process_time()


def spent(block: Mapping[str, Any], stage: str, begun: Clocks) -> dict[str, dict[str, float]]:
    """The `seconds` and `processor_seconds` of `block` by stage, with those of `stage` since `begun` added."""
    found = {}
    for name, begin, now in zip(("seconds", "processor_seconds"), begun, clocks(), strict=True):
        before: dict[str, float] = block.get(name, {})
        found[name] = {**before, stage: before.get(stage, 0.0) + now - begin}
    return found
