"""An offset of a sensor that drifts with the run order is told from what else drifts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.naming import name
from slipstick.recordings import Recordings
from tests.benches import HEAVY
from tests.validation.hidden import Case, write

COUNT = 36


def recorded(folder: Path, seed: int, sensor: str, drift: float) -> Recordings:
    """Recordings of the hidden bench, in which the offset of a sensor drifts by `drift` in its unit over the test."""
    write(folder / "case.h5", Case(seed=seed, count=COUNT))
    found = Recordings.open(folder / "case.h5")
    assert found.signals is not None
    assert found.run_order is not None
    share = found.run_order / (COUNT - 1)
    changed = found.signals[sensor] + drift * (share**0.7)[:, None]
    return replace(found, signals=replace(found.signals, **{sensor: changed}))


@pytest.mark.slow
@pytest.mark.parametrize(("sensor", "drift"), [("output_torque", 12.0), ("output_speed", 0.8), ("input_speed", 1.5)])
def test_a_drift_is_named_and_measured(tmp_path: Path, sensor: str, drift: float) -> None:
    found = name(HEAVY, recorded(tmp_path, 716, sensor, drift))
    pair = f"{sensor.replace('_', ' ')} sensor", "run order"
    assert [one.pair for one in found.findings] == [pair]
    law = found.measured[pair]
    assert law.x is not None
    true = drift * (law.x / (COUNT - 1)) ** 0.7
    np.testing.assert_allclose(law.change, true, atol=0.25 * drift)
