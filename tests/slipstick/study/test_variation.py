"""Scatter of parameters that a fit holds alike in all runs."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.bench.conditions import Conditions
from slipstick.study.linearised import Linearised
from slipstick.study.marginal import State
from slipstick.study.mixed import MixedFit
from slipstick.study.variation import covariance
from tests.benches import HEAVY

N, VALUES, NOISE = 216, 40, 1.0
STD = 0.03


@pytest.fixture
def conditions() -> Conditions:
    return HEAVY.conditions


def varied(linear_fit: MixedFit, third: np.ndarray) -> MixedFit:
    """A fit that holds the third parameter alike, of experiments in which it is off by `third` (n,)."""
    rng = np.random.default_rng(7)
    jacobian = rng.standard_normal((N, VALUES, 3)) * (20.0, 30.0, 40.0)
    own = 0.05 * rng.standard_normal((N, 2))
    residual = (jacobian @ np.c_[np.zeros((N, 2)), third][..., None])[..., 0] + NOISE * rng.standard_normal((N, VALUES))
    rows = np.concatenate([jacobian, residual[..., None]], axis=2)
    about = Linearised((rows.transpose(0, 2, 1) @ rows)[None], residual)
    return replace(linear_fit, about=about, state=State(np.ones(3), own, 0.0025 * np.eye(2), np.ones(1)),
                   log_likelihood=np.zeros(N))


def test_finds_how_much_a_parameter_varies_that_the_fit_holds_alike(linear_fit: MixedFit,
                                                                    conditions: Conditions) -> None:
    found = varied(linear_fit, STD * np.random.default_rng(8).standard_normal(N))
    spread = covariance(conditions, found)
    assert np.sqrt(spread[2, 2]) == pytest.approx(STD, rel=0.15)
    np.testing.assert_allclose(spread[:2, :2], found.scatter)


def test_what_follows_the_conditions_is_no_scatter(linear_fit: MixedFit, conditions: Conditions) -> None:
    speed = conditions.motor_speed
    systematic = STD * (speed - speed.mean()) / speed.std()
    assert np.sqrt(covariance(conditions, varied(linear_fit, systematic))[2, 2]) < 0.2 * STD
