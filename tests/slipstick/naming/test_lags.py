"""Lags of signals: each is the filter of the simulator, and their sums are those of the columns."""

import numpy as np
import pytest

from slipstick.clutch.lag import lagged_signal
from slipstick.clutch.model import Model
from slipstick.naming.converter_lag import lag_columns, lagging
from slipstick.naming.input import InputBlock
from slipstick.naming.lags import late_by, mixed
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

TIME, SCALE = np.linspace(0, 1, 501), 0.02
LAGS = SCALE * np.array([0.1, 0.3, 1, 3])
SIGNAL = np.stack([np.sin(6 * TIME) * TIME, np.minimum(1, 4 * TIME) - 0.5, np.exp(-TIME)])


def test_lags_are_those_of_the_simulator() -> None:
    expected = [lagged_signal(SIGNAL, TIME, np.array([lag])) - SIGNAL for lag in LAGS]
    np.testing.assert_allclose(late_by(SIGNAL, TIME, SCALE), np.stack(expected, axis=1), rtol=0, atol=1e-14)


def test_a_ramp_is_read_late_by_the_lag() -> None:
    late = late_by(5 * TIME[None], TIME, SCALE)
    np.testing.assert_allclose(late[0, :, -1], -5 * LAGS, rtol=1e-5)


@pytest.mark.parametrize("shape", [(1, 4, 1), (3, 4, 1), (1, 4, 501), (3, 4, 501)])
def test_a_mixture_is_the_sum_of_the_weighted_lags(shape: tuple[int, ...]) -> None:
    weights = np.random.default_rng(5).standard_normal(shape)
    expected = (weights * late_by(SIGNAL, TIME, SCALE)).sum(axis=1)
    np.testing.assert_allclose(mixed(SIGNAL, TIME, SCALE, weights), expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("finer", [0, 1, 2])
def test_a_lagging_converter_is_the_sum_over_its_columns(finer: int) -> None:
    block = block_of("input", scene_of(HEAVY, Model(HEAVY.physics), 8, 3))
    assert isinstance(block, InputBlock)
    torque = 1e3 * block.scene.smooth["input_speed"]
    columns = lag_columns(block.scene, torque, finer)
    c = np.random.default_rng(6).standard_normal(columns.shape[1])
    expected = c @ columns
    np.testing.assert_allclose(lagging(block.scene, torque, c, finer), expected, rtol=0,
                               atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("lag", [0.003, 0.01, 0.04])
def test_a_lag_between_is_a_combination_of_those_of_the_basis(lag: float) -> None:
    signal = np.clip(4 * TIME - 1, 0, 1)[None] + 0.3 * np.sin(15 * TIME)
    change = (lagged_signal(signal, TIME, np.array([lag])) - signal)[0]
    basis = late_by(signal, TIME, SCALE)[0].T
    left = change - basis @ np.linalg.lstsq(basis, change)[0]
    assert np.linalg.norm(left) < 0.02 * np.linalg.norm(change)
    alone = change - basis[:, 2:3] @ np.linalg.lstsq(basis[:, 2:3], change)[0]
    assert np.linalg.norm(alone) > 0.05 * np.linalg.norm(change)
