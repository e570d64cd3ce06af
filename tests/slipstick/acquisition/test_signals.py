"""Signals of files: their new clock, flaws in them, and the lock-up that the speeds show."""

import numpy as np
import pytest
from scipy.signal import lfilter

from slipstick.acquisition.clock import GAP, own_clock, resampled, sampling_step
from slipstick.acquisition.flaws import flaws
from slipstick.acquisition.lock_up import lock_up
from slipstick.bench import Bench, parameters
from slipstick.blocks.sensor_noise import sensor_noise
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from tests.benches import TABLES

STEP = 0.01
WANTED = np.arange(20, 480) * STEP


def gain(frequency: float, step: float = STEP / 20) -> float:
    """Largest amplitude that is left of a sine of amplitude 1."""
    time = np.arange(0, 5, step)
    values = np.exp(2j * np.pi * frequency * time)
    return float(np.abs(resampled(time, values.real, WANTED, STEP) + 1j * resampled(
        time, values.imag, WANTED, STEP)).max())


def test_samples_on_the_new_clock_stay_as_they_are() -> None:
    time = np.arange(500) * STEP
    values = np.random.default_rng(1).normal(size=500)
    np.testing.assert_allclose(resampled(time, values, time, STEP), values, atol=1e-12)


def test_a_straight_line_stays_one_on_any_clock() -> None:
    shifted = np.arange(500) * STEP + 0.3 * STEP
    np.testing.assert_allclose(resampled(shifted, 3 * shifted - 1, WANTED, STEP), 3 * WANTED - 1, atol=1e-9)
    time = np.arange(0, 5, STEP / 7.3)
    np.testing.assert_allclose(resampled(time, 3 * time - 1, WANTED, STEP), 3 * WANTED - 1, atol=3 * STEP / 7.3 / 40)


@pytest.mark.parametrize("period", [2, 2.5, 5, 7.3, 20, 40])
def test_values_held_on_a_faster_clock_are_used_at_their_own_rate(period: float) -> None:
    time = np.arange(2000) * 1e-3
    begins = np.ceil(np.arange(-1, 2000 / period) * period)  # the sample at which each value of the slow clock appears
    values = np.random.default_rng(2).normal(size=len(begins))
    values[10] = values[11]  # as it may be by chance
    held = values[np.searchsorted(begins, np.arange(2000), side="right") - 1]
    own_time, own_values, note = own_clock(time, held)
    assert "held on a faster clock" in note
    assert sampling_step(own_time) == pytest.approx(period * 1e-3, abs=0.5e-3)
    inside = begins[(begins >= period) & (begins < 2000 - period)]
    np.testing.assert_allclose(np.interp(inside * 1e-3, own_time, own_values), held[inside.astype(int)], atol=1e-12)
    assert np.diff(own_time).max() < GAP * sampling_step(own_time) + 1.1e-3


RANDOM = np.random.default_rng(3).normal(size=2000)


@pytest.mark.parametrize("values", [
    RANDOM, np.round(RANDOM), np.floor(np.arange(2000) / 7.0), np.sin(np.arange(2000) / 100).round(2), np.ones(2000),
    np.repeat([0.0, 5.0, 2.0, 9.0] * 10, [20, 50, 11, 119] * 10), np.where(np.arange(2000) % 100 < 50, 0.0, 1.0)])
def test_values_that_are_sampled_at_their_clock_stay(values: np.ndarray) -> None:
    """Noise, coarse resolutions, a counter, rest, the steps of a set point, a digital channel."""
    time = np.arange(2000) * 1e-3
    same_time, same_values, note = own_clock(time, values)
    assert (same_time is time, same_values is values, note) == (True, True, "")


def test_a_channel_whose_values_are_mostly_missing_is_used_at_its_own_rate() -> None:
    time = np.arange(2000) * 1e-3
    own_time, own_values, note = own_clock(time, np.where(np.arange(2000) % 5 == 2, RANDOM, np.nan))
    np.testing.assert_array_equal(own_time, time[2::5])
    np.testing.assert_array_equal(own_values, RANDOM[2::5])
    assert note == "most of its values are missing: it is used every 5 ms"
    assert own_clock(time, np.where(np.arange(2000) < 900, np.nan, RANDOM))[2] == ""  # one long gap


def test_the_filter_is_as_stated() -> None:
    rate = 1 / STEP
    assert gain(0.02 * rate) == pytest.approx(1, abs=0.002)
    assert gain(0.5 * rate) == pytest.approx(10 ** (-3.9 / 20), abs=0.01)
    assert gain(rate) < 0.005
    assert max(gain(share * rate) for share in (1.2, 1.43, 2.5, 3.4)) < 10 ** (-13 / 20)


def test_a_jump_does_not_ring_and_reaches_one_sample() -> None:
    time = np.arange(0, 5, STEP / 20)
    jump = resampled(time, (time > 2.5).astype(float), WANTED, STEP)
    assert 0 <= jump.min() <= jump.max() <= 1 + 1e-12
    far = np.abs(WANTED - 2.5) > STEP
    np.testing.assert_allclose(jump[far], (WANTED > 2.5)[far], atol=1e-9)


@pytest.mark.parametrize(("correlation", "within"), [(0.0, 0.03), (0.3, 0.08)])
def test_the_noise_of_means_is_what_calibration_and_study_take_it_for(correlation: float, within: float) -> None:
    noise = lfilter([1], [1, -correlation], np.random.default_rng(4).normal(size=(6, 20_000)), axis=1)
    time = np.arange(20_000) * 1e-3
    means = np.array([resampled(time, one, 0.5e-3 + np.arange(5, 9_990) * 2e-3, 2e-3) for one in noise])
    std, found = sensor_noise("x", means)
    assert std == pytest.approx(means.std(), rel=within)
    assert found == pytest.approx(np.corrcoef(means[:, 1:].ravel(), means[:, :-1].ravel())[0, 1], abs=2 * within)


def test_out_of_reach_there_is_no_value() -> None:
    assert np.isnan(resampled(np.arange(100) * STEP, np.ones(100), np.array([2.0]), STEP)).all()


# Gaps, spikes and saturation are found where they are, and nowhere else.


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


# Lock-up from the speeds, against made-up slips and against the shifting times that are recorded.


LONG_TIME = np.arange(1500) * 1e-3


def slip(lock: float, noise: float = 0.3, offset: float = 0.0, seed: int = 1) -> np.ndarray:
    ahead = np.maximum(lock - LONG_TIME, 0)
    return 100 * ahead + 20 * ahead**2 + offset + np.random.default_rng(seed).normal(0, noise, len(LONG_TIME))


def test_lock_up_lies_between_samples() -> None:
    found = lock_up(LONG_TIME, slip(0.61237, noise=1e-6))
    assert found is not None
    assert found.time == pytest.approx(0.61237, abs=1e-6)
    assert found.slope == pytest.approx(100, rel=1e-3)


def test_its_error_is_that_of_repeated_measurements() -> None:
    found = [lock_up(LONG_TIME, slip(0.61237, seed=seed, offset=0.5)) for seed in range(25)]
    away = np.array([(one.time - 0.61237) / one.error for one in found if one is not None])
    assert len(away) == 25
    assert 0.75 < np.sqrt(np.mean(away**2)) < 1.3


def test_what_does_not_lock_has_none() -> None:
    assert lock_up(LONG_TIME, np.full(1500, 50.0)) is None
    assert lock_up(LONG_TIME, slip(1.6)) is None
    assert lock_up(LONG_TIME, np.where(LONG_TIME == 0.3, np.nan, slip(0.6))) is None


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
