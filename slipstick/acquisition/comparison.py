"""One imported engagement beside the nominal model of its bench, which shows what a mapping has wrong."""

from dataclasses import dataclass

import numpy as np

from slipstick.bench import Bench, parameters
from slipstick.clutch.ensemble import signals
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings


@dataclass(frozen=True, eq=False)
class Comparison:
    """The measured signals (k,) as the nominal model has them at the conditions of the engagement `row`.

    `lock` is its lock-up in s, if any.
    """

    row: int
    simulated: dict[str, np.ndarray]
    lock: float | None
    gear_ratio: float


def compare(recordings: Recordings, bench: Bench) -> Comparison | None:
    """The engagement with the median shifting time; None without signals."""
    if recordings.signals is None:
        return None
    row = int(np.argsort(recordings.measured_time, kind="stable")[len(recordings) // 2])
    response = signals(Model(bench.physics), recordings.conditions.take([row]), recordings.signals.time)
    lock = float(response.shifting_time[0, 0])
    return Comparison(row, {name: getattr(response, name)[0, 0] for name in recordings.signals.names},
                      lock if np.isfinite(lock) else None, bench.physics.nominal[parameters.index("gear_ratio")])
