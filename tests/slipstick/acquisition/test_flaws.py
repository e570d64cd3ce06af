"""Gaps, spikes and saturation are found where they are, and nowhere else."""

import numpy as np
import pytest

from slipstick.acquisition.flaws import flaws
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from tests.benches import TABLES

TIME = np.arange(1000) * 1e-3
NOISE = np.random.default_rng(3).normal(0, 0.05, 1000)
SIGNAL = 5 * np.sin(4 * TIME) + NOISE


def kinds(values: np.ndarray, time: np.ndarray = TIME, **options: object) -> list[tuple[str, float, float]]:
    return [(one.kind, round(one.start, 6), round(one.end, 6)) for one in flaws(time, values, **options)]  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["measured", "measured-compact"])
def test_the_shipped_recordings_have_none(name: str) -> None:
    signals = Recordings.open(TABLES / f"{name}.h5").signals
    assert signals is not None
    for channel in SIGNAL_UNITS:
        assert not [row for row, values in enumerate(getattr(signals, channel)[::6]) if flaws(signals.time, values)]


@pytest.mark.parametrize("values", [SIGNAL, np.where(TIME > 0.5, SIGNAL + 50, SIGNAL), np.round(SIGNAL), np.ones(1000),
                                    np.clip(SIGNAL, 0, None), 100 * np.exp(-0.5 * ((TIME - 0.5) / 0.004) ** 2)],
                         ids=["noise", "jump", "coarse", "constant", "rest at zero", "short bump"])
def test_sound_signals_have_none(values: np.ndarray) -> None:
    assert kinds(values) == []


def test_missing_samples_and_missing_values_are_gaps() -> None:
    kept = (TIME < 0.3) | (TIME > 0.31)
    assert kinds(SIGNAL[kept], TIME[kept]) == [("gap", 0.299, 0.311)]
    assert kinds(np.where(kept, SIGNAL, np.nan)) == [("gap", 0.299, 0.311)]


@pytest.mark.parametrize("width", [1, 2])
def test_short_spikes_are_found(width: int) -> None:
    values = SIGNAL.copy()
    values[400:400 + width] += 8
    assert {one[0] for one in kinds(values)} == {"spike"}
    assert kinds(values)[0][1:] == (0.4, 0.4)


def test_clipping_is_found_and_with_limits_at_rest_as_well() -> None:
    assert kinds(np.clip(SIGNAL, None, 4))[0][0] == "saturation"
    resting = np.clip(SIGNAL, 0, None)
    assert kinds(resting) == []
    assert kinds(resting, limits=(0.0, 10.0))[0][0] == "saturation"
