"""The noise of a sensor is bounded by what a block leaves of its signal, and is not raised by what the block lacks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from slipstick.clutch.model import Model
from slipstick.naming.residual_noise import bounded
from slipstick.naming.start import begin
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

STD, RHO, SHAPE = 0.3, 0.85, (40, 800)
EVERY = np.ones(SHAPE, bool)


@pytest.fixture(scope="module")
def left() -> np.ndarray:
    white = np.random.default_rng(2).standard_normal((SHAPE[0], SHAPE[1] + 100)) * STD * np.sqrt(1 - RHO**2)
    return np.asarray(lfilter([1], [1, -RHO], white)[:, 100:])


def test_noise_with_too_much_power_becomes_that_of_the_residuals(left: np.ndarray) -> None:
    std, rho = bounded((10 * STD, 0.999), left, EVERY)
    assert std == pytest.approx(STD, rel=0.05)
    assert rho == pytest.approx(RHO, abs=0.02)


def test_samples_that_do_not_count_say_nothing(left: np.ndarray) -> None:
    counted = EVERY.copy()
    counted[:, 300:500] = False
    assert bounded((10 * STD, 0.999), np.where(counted, left, 1e6), counted) == pytest.approx((STD, RHO), rel=0.05)


def test_noise_that_is_about_right_stays(left: np.ndarray) -> None:
    assert bounded((1.1 * STD, 0.87), left, EVERY) == (1.1 * STD, 0.87)


def test_what_a_block_lacks_does_not_raise_the_noise(left: np.ndarray) -> None:
    slow = 20 * STD * np.sin(np.linspace(0, 6, SHAPE[1]))
    assert bounded((STD, RHO), left + slow, EVERY) == (STD, RHO)


def test_the_blocks_of_an_engagement_start_with_the_bounded_noise() -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), 30, seed=1)
    std = scene.noise["output_speed"][0]
    scene = replace(scene, noise={**scene.noise, "output_speed": (12 * std, 0.999)})
    found = begin(scene, lambda _: None)
    assert found.noise["output_speed"][0] == pytest.approx(std, rel=0.1)
    assert abs(found.noise["output_speed"][1]) < 0.3
    assert found.noise["pressure"] == scene.noise["pressure"]
    assert 0.85 < found.fits["load"].chi2.mean() < 1.05  # the residuals have integrated torque noise


def test_residuals_that_grow_have_no_correlation_above_one() -> None:
    drift = np.cumsum(np.ones(SHAPE), axis=1) ** 3
    assert bounded((1.0, 0.5), drift, EVERY) == (1.0, 0.5)
    _, rho = bounded((1e12, 0.999), drift + np.linspace(-1, 1, SHAPE[0])[:, None], EVERY)
    assert 0 < rho < 1
