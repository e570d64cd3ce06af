"""Confidence follows from standard errors and the number of findings, as the names of other lists do."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import chi2

from slipstick.study.confidence import BANDS, confidence, counted, names


def test_confidence_rises_with_standard_errors_and_falls_with_further_findings() -> None:
    assert (np.diff(confidence(1, np.array([4.0, 8.0, 16.0, 32.0, 64.0]))) > 0).all()
    assert (np.diff(confidence(np.arange(1, 7), 20.0)) < 0).all()


def test_the_mean_confidence_is_the_share_of_right_names() -> None:
    """The score equations of a logistic regression: weighted by each variable, expected and right names agree."""
    rows = np.concatenate(list(names().values()))
    left = rows[:, 2] - confidence(*rows[:, :2].T)
    for column in (np.ones(len(rows)), np.log(rows[:, 1]), rows[:, 0]):
        assert left @ column == pytest.approx(0, abs=0.05)


def test_a_list_does_not_predict_itself() -> None:
    which, rows = next(iter(names().items()))
    assert not np.allclose(confidence(*rows[:, :2].T, which), confidence(*rows[:, :2].T))


def test_evidence_predicts_the_names_of_other_lists_better_than_their_share_does() -> None:
    gain = []
    for which, rows in names().items():
        others = np.concatenate([its for other, its in names().items() if other != which])[:, 2].mean()
        sure, right = confidence(*rows[:, :2].T, which), rows[:, 2] == 1
        gain += np.where(right, np.log(sure / others), np.log((1 - sure) / (1 - others))).tolist()
    assert 2 * sum(gain) > chi2.ppf(0.999, 2)


def test_every_name_is_counted_in_one_band() -> None:
    each = [counted((low + high) / 2) for low, high in pairwise(BANDS)]
    assert [(one.lower, one.upper) for one in each] == list(pairwise(BANDS))
    rows = np.concatenate(list(names().values()))
    assert sum(one.of for one in each) == len(rows)
    assert sum(one.right for one in each) == rows[:, 2].sum()
    assert counted(1.0) == each[-1]
