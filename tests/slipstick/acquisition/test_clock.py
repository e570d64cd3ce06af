"""The anti-alias filter does what its description says."""

import numpy as np
import pytest
from scipy.signal import lfilter

from slipstick.acquisition.clock import resampled
from slipstick.blocks.sensor_noise import sensor_noise

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


def test_the_filter_is_as_stated() -> None:
    rate = 1 / STEP
    assert gain(0.02 * rate) == pytest.approx(1, abs=0.002)
    assert gain(0.5 * rate) == pytest.approx(10 ** (-3.9 / 20), abs=0.01)
    assert gain(rate) < 0.005
    assert max(gain(share * rate) for share in (1.2, 1.43, 2.5, 3.4)) < 10 ** (-13 / 20)


def test_without_the_filter_the_same_tone_aliases() -> None:
    time = np.arange(0, 5, STEP / 20)
    tone = np.sin(2 * np.pi * 1.01 / STEP * time)
    assert np.abs(tone[::20]).max() > 0.99
    assert np.abs(resampled(time, tone, WANTED, STEP)).max() < 0.02


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
