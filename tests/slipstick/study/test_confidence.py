"""Confidence follows from standard errors and what else was found, as the names of other lists do."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import chi2

from slipstick.study.confidence import BANDS, confidence, counted, names


def test_confidence_rises_with_standard_errors_and_falls_with_further_findings() -> None:
    assert (np.diff(confidence(2, np.array([4.0, 8.0, 16.0, 32.0, 64.0]), 0)) > 0).all()
    assert (np.diff(confidence(np.arange(1, 7), 20.0, 0)) < 0).all()
    assert confidence(2, 20.0, 1) < confidence(2, 20.0, 0)


def test_fewer_standard_errors_than_one_count_as_one() -> None:
    assert confidence(1, -3.0, 0) == confidence(1, 1.0, 0)


def test_the_mean_confidence_is_the_share_of_right_names() -> None:
    """A score equation of a logistic regression."""
    every = np.concatenate(list(names().values()))
    assert (every[:, 3] - confidence(*every[:, :3].T)).sum() == pytest.approx(0, abs=1e-6)


def test_a_list_does_not_predict_itself() -> None:
    which, rows = next(iter(names().items()))
    assert not np.allclose(confidence(*rows[:, :3].T, which), confidence(*rows[:, :3].T))


def test_evidence_predicts_the_names_of_other_lists_better_than_their_share_does() -> None:
    gain = []
    for which, rows in names().items():
        others = np.concatenate([its for other, its in names().items() if other != which])[:, 3].mean()
        sure, right = confidence(*rows[:, :3].T, which), rows[:, 3] == 1
        gain += np.where(right, np.log(sure / others), np.log((1 - sure) / (1 - others))).tolist()
    assert 2 * sum(gain) > chi2.ppf(0.99, 3)


def test_every_name_is_counted_in_one_band() -> None:
    each = [counted((low + high) / 2) for low, high in pairwise(BANDS)]
    assert [(one.lower, one.upper) for one in each] == list(pairwise(BANDS))
    rows = np.concatenate(list(names().values()))
    assert sum(one.of for one in each) == len(rows)
    assert sum(one.right for one in each) == rows[:, 3].sum()
    assert counted(1.0) == each[-1]
