"""Confidence follows from standard errors and the number of findings, as the names of other lists do."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import chi2

from slipstick.study.confidence import BANDS, ON_NEW_BENCHES, confidence, counted, names


def test_confidence_rises_with_standard_errors_and_falls_with_further_findings() -> None:
    assert (np.diff(confidence(1, np.array([4.0, 8.0, 16.0, 32.0, 64.0]))) > 0).all()
    assert (np.diff(confidence(np.arange(1, 7), 20.0)) < 0).all()


def on_new_benches() -> dict[str, np.ndarray]:
    return {which: rows for which, rows in names().items() if which in ON_NEW_BENCHES}


def test_the_mean_confidence_is_the_share_of_right_names_on_new_benches() -> None:
    """A score equation of a logistic regression. On the benches of the development more names are right."""
    new = np.concatenate(list(on_new_benches().values()))
    assert (new[:, 2] - confidence(*new[:, :2].T)).sum() == pytest.approx(0, abs=1e-6)
    others = np.concatenate([rows for which, rows in names().items() if which not in ON_NEW_BENCHES])
    expected = confidence(*others[:, :2].T)
    assert others[:, 2].sum() > expected.sum() + 3 * np.sqrt((expected * (1 - expected)).sum())


def test_a_list_does_not_predict_itself() -> None:
    which, rows = next(iter(names().items()))
    assert not np.allclose(confidence(*rows[:, :2].T, which), confidence(*rows[:, :2].T))


def test_evidence_predicts_the_names_of_other_lists_better_than_their_share_does() -> None:
    gain = []
    for which, rows in on_new_benches().items():
        others = np.concatenate([its for other, its in on_new_benches().items() if other != which])[:, 2].mean()
        sure, right = confidence(*rows[:, :2].T, which), rows[:, 2] == 1
        gain += np.where(right, np.log(sure / others), np.log((1 - sure) / (1 - others))).tolist()
    assert 2 * sum(gain) > chi2.ppf(0.99, 2)


def test_every_name_on_a_new_bench_is_counted_in_one_band() -> None:
    each = [counted((low + high) / 2) for low, high in pairwise(BANDS)]
    assert [(one.lower, one.upper) for one in each] == list(pairwise(BANDS))
    rows = np.concatenate(list(on_new_benches().values()))
    assert sum(one.of for one in each) == len(rows)
    assert sum(one.right for one in each) == rows[:, 2].sum()
    assert counted(1.0) == each[-1]
