"""Scores of engagements in the direction of a law that the others give, against dense matrices."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.naming.evidence import FOLDS, Table, gains
from slipstick.naming.grams import Gram
from slipstick.naming.linear_model import Further, Part
from slipstick.naming.selection import in_agreement, in_errors

PAIR = ("quantity", "signal")
N, SAMPLES = 36, 60


def table(size: np.ndarray, seed: int) -> tuple[Table, np.ndarray, np.ndarray, np.ndarray]:
    """A block with one random parameter and a law of two columns, whose size differs between engagements.

    Returns it and its whitened columns: random (n, k, 1), of the law (n, k, 2), and the residual (n, k).
    """
    random = np.random.default_rng(seed)
    own, law = random.standard_normal((N, SAMPLES, 1)), random.standard_normal((N, SAMPLES, 2))
    left = own[:, :, 0] * (0.5 * random.standard_normal(N))[:, None] + random.standard_normal((N, SAMPLES))
    left = left + size[:, None] * (law @ [0.6, -0.8]) / np.sqrt(SAMPLES)
    columns = np.concatenate([own, left[:, :, None]], axis=2)
    gram = Gram(columns.transpose(0, 2, 1) @ columns, 1, np.zeros(1), np.zeros(1), np.array([2.0]))
    further = Further(law.transpose(0, 2, 1) @ columns, law.transpose(0, 2, 1) @ law)
    fit: Any = SimpleNamespace(block=SimpleNamespace(name="any"), fitted=SimpleNamespace(variance=np.array([0.2])))
    return Table(fit, Part(gram, 0, {}), {PAIR: further}), own, law, left


def test_a_score_is_that_of_the_others_direction_under_the_marginal_covariance() -> None:
    its, own, law, left = table(np.full(N, 2.0), 1)
    found = gains([its], [], [PAIR])[0]
    for i in (0, 7, 20):
        inverse = np.linalg.inv(np.eye(SAMPLES) + found.fitted.variance[0] * own[i] @ own[i].T)
        residual = left[i] - own[i, :, 0] * found.without[i, 0]
        step = law[i] @ found.held[i, 1:] + own[i, :, 0] * (found.held[i, 0] - found.without[i, 0])
        size = np.sqrt(step @ inverse @ step)
        assert found.scores[i] == pytest.approx(step @ inverse @ residual / max(size, 1.0), rel=1e-9)
    folds = np.random.default_rng(0).permutation(np.arange(N) % FOLDS)
    assert len(np.unique(found.held, axis=0)) == FOLDS
    for fold in range(FOLDS):
        assert len(np.unique(found.held[folds == fold], axis=0)) == 1


def test_engagements_agree_where_a_law_has_many_sizes_and_where_its_gain_does_not_show_it() -> None:
    size = np.where(np.arange(N) % 3 == 0, 40.0, 4.0)
    found = gains([table(size, 2)[0]], [], [PAIR])[0]
    assert found.nats.sum() > 100
    assert in_errors(found.nats) < 0 < 4 < in_agreement(found.scores)


def test_without_a_law_scores_are_noise() -> None:
    scores = np.concatenate([gains([table(np.zeros(N), seed)[0]], [], [PAIR])[0].scores for seed in range(40)])
    assert abs(scores.mean()) < 4 * scores.std() / np.sqrt(len(scores))
    assert scores.std() < 1.1
