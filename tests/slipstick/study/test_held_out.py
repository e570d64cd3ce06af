from dataclasses import replace

import numpy as np
import pytest

from slipstick.study.climb import Limits
from slipstick.study.held_out import folds, without
from slipstick.study.mixed import MixedFit
from tests.benches import HEAVY


def test_folds_leave_out_every_motor_speed_and_every_profile_once() -> None:
    conditions = HEAVY.conditions
    left_out = folds(conditions, seed=1)
    assert len(left_out) == 4 + 6
    np.testing.assert_array_equal(np.sum(left_out, axis=0), 2)
    for rows in left_out[:4]:
        assert len(np.unique(conditions.motor_speed[rows])) == 1
        assert not set(conditions.motor_speed[rows]) & set(conditions.motor_speed[~rows])


def test_few_kinds_are_split_at_random_each_experiment_once() -> None:
    conditions = HEAVY.conditions.take([0, 1, 2, 9, 10, 11])
    np.testing.assert_array_equal(np.sum(folds(conditions, seed=1), axis=0), 1)


def test_a_fit_without_a_fold_is_the_least_squares_solution_without_it(linear_fit: MixedFit) -> None:
    rows = np.arange(60) < 15
    integrated, limits = linear_fit.marginal, Limits.of(linear_fit.design)
    information = integrated.information[~rows].sum(axis=0) + np.diag(limits.precision)
    # All experiments together pull a fit nowhere; the prior is centred on this fit's theta.
    score = (integrated.score - integrated.score.mean(axis=0))[~rows].sum(axis=0)
    expected = 1 + np.linalg.solve(information, score)
    assert np.all(np.abs(expected - 1) < limits.reach), "else the reach would decide"
    np.testing.assert_allclose(without(linear_fit, rows), expected, rtol=1e-6)
    assert not np.allclose(without(linear_fit, rows), without(linear_fit, ~rows), atol=1e-4)


def test_a_fit_without_a_fold_stays_within_reach(linear_fit: MixedFit) -> None:
    far = linear_fit.about.gram.copy()
    far[:, :, :3, 3] *= 1e3
    far[:, :, 3, :3] *= 1e3
    pushed = replace(linear_fit, about=replace(linear_fit.about, gram=far))
    step = np.abs(without(pushed, np.arange(60) < 15) - 1)
    assert step.max() == pytest.approx(0.1)
