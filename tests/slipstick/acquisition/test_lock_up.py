"""Lock-up from the speeds, against made-up slips and against the shifting times that are recorded."""

import numpy as np
import pytest

from slipstick.acquisition.lock_up import lock_up
from slipstick.bench import Bench, parameters
from slipstick.recordings import Recordings
from tests.benches import TABLES

TIME = np.arange(1500) * 1e-3


def slip(lock: float, noise: float = 0.3, offset: float = 0.0, seed: int = 1) -> np.ndarray:
    ahead = np.maximum(lock - TIME, 0)
    return 100 * ahead + 20 * ahead**2 + offset + np.random.default_rng(seed).normal(0, noise, len(TIME))


def test_lock_up_lies_between_samples() -> None:
    found = lock_up(TIME, slip(0.61237, noise=1e-6))
    assert found is not None
    assert found.time == pytest.approx(0.61237, abs=1e-6)
    assert found.slope == pytest.approx(100, rel=1e-3)


def test_its_error_is_that_of_repeated_measurements() -> None:
    found = [lock_up(TIME, slip(0.61237, seed=seed, offset=0.5)) for seed in range(25)]
    away = np.array([(one.time - 0.61237) / one.error for one in found if one is not None])
    assert len(away) == 25
    assert 0.75 < np.sqrt(np.mean(away**2)) < 1.3


def test_what_does_not_lock_has_none() -> None:
    assert lock_up(TIME, np.full(1500, 50.0)) is None
    assert lock_up(TIME, slip(1.6)) is None
    assert lock_up(TIME, np.where(TIME == 0.3, np.nan, slip(0.6))) is None


@pytest.mark.parametrize(("name", "bench", "within"), [
    ("measured", "heavy", 4.0e-3), ("measured-compact", "compact", 3e-3)])
def test_it_agrees_with_recorded_shifting_times(name: str, bench: str, within: float) -> None:
    """The difference is that of the recorded time alone, whose noise is 3 and 2 ms, and has no larger bias."""
    recordings, given = Recordings.open(TABLES / f"{name}.h5"), Bench.open(TABLES / f"{bench}.toml")
    signals, gear = recordings.signals, given.physics.nominal[parameters.index("gear_ratio")]
    assert signals is not None
    rows = range(0, len(recordings), 3)
    found = [lock_up(signals.time, signals.input_speed[row] - gear * signals.output_speed[row]) for row in rows]
    away = np.array([one.time - recordings.measured_time[row] for one, row in zip(found, rows, strict=True) if one])
    assert len(away) == len(rows)
    assert np.sqrt(np.mean(away**2)) < within
    assert abs(away.mean()) < (given.sensors["shifting_time"].noise or 0) / 2
    assert np.median([one.error for one in found if one]) < 1e-3
