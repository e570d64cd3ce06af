"""Samples of slip end at lock-up, and samples after lock-up where the plates may slip again."""

import numpy as np
import pytest

from slipstick.bench.conditions import Conditions
from slipstick.clutch import ensemble
from slipstick.naming.release import released, slips_until
from tests.benches import NOMINAL

TIME = np.arange(0.0, 3.0, 2e-3)
FALLS = np.array([[0, 0.002, 0.105, 0.115, 0.255, 0.8, 1.2, 1.6, 2.4, 3.2]])
CURRENT = np.array([[0.1, 0.7, 0.7, 0.3, 0.3, 0.7, 0.7, 0.15, 0.15, 0.15]])


def engagement(current: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What `released` finds, (k,), and where the plates slip after lock-up."""
    conditions = Conditions(np.zeros(1, np.int64), np.array([105.0]), np.array([6.0]), np.array([80.0]), FALLS, current)
    response = ensemble.signals(NOMINAL, conditions, TIME, accuracy=ensemble.TIGHT)
    locks = response.shifting_time[0, 0]
    found = released(response.output_torque[0], response.pressure[0], (locks - 0.01 > TIME)[None],
                     (locks + 0.01 < TIME)[None])[0]
    slip = response.input_speed[0, 0] / 3.2 - response.output_speed[0, 0]
    return found, (np.abs(slip) > 1e-3) & (locks + 0.01 < TIME)


def test_where_the_pressure_falls_the_plates_slip_again_and_are_released_before() -> None:
    found, slips = engagement(CURRENT)
    assert slips.sum() > 100
    assert np.all(found[slips])
    assert TIME[np.argmax(slips)] - 0.1 < TIME[np.argmax(found)] <= TIME[np.argmax(slips)]
    assert np.all(np.diff(found.astype(int)) >= 0)  # from there on


@pytest.mark.parametrize("last", [0.7, 0.6])
def test_plates_that_stay_locked_are_not_released(last: float) -> None:
    found, slips = engagement(np.where(FALLS > 1.5, last, CURRENT))
    assert not slips.any()
    assert not found.any()


def late(error: float, noise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What `slips_until` finds, (2, k), where the plates slip, and what is before a shifting time late by `error` s."""
    locks = np.array([0.6, 0.9])[:, None]
    slip = 100.0 * np.sqrt(np.maximum(1 - TIME / locks, 0))
    random = np.random.default_rng(2)
    measured = 3.0 + slip + noise * random.standard_normal(slip.shape)  # with an offset of the speeds
    before = locks + error - 0.01 > TIME
    return slips_until(measured, locks + error + 0.01 < TIME), slip > 0, before


def test_samples_after_a_lock_up_that_was_measured_late_are_not_taken_for_slip() -> None:
    found, slips, before = late(0.05, 0.5)
    assert np.any(before & ~slips)
    assert not np.any(before & found & ~slips)
    assert np.all(found[slips].reshape(-1)[:100])
    assert (slips & ~found).sum() < 10  # near lock-up
    found, slips, before = late(0.0, 0.5)
    assert (before & ~found).sum() < 10


def test_without_samples_after_lock_up_all_are_taken_for_slip() -> None:
    slip = np.ones((2, 30))
    assert np.all(slips_until(slip, np.zeros(slip.shape, bool)))
