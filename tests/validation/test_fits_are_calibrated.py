"""Coverage of intervals and predictions on data drawn from the table, a short `python -m benchmarks.coverage`."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom, chi2

from benchmarks import coverage
from slipstick.uncertainty.fit.intervals import drop_at_level

EVERY = 4  # step between the conditions used, of those of the table
INTERVAL_SEEDS, PREDICTION_SEEDS = range(1, 6), range(201, 209)
PARTS, LOWEST_P = 3, 1e-3


def drops(seed: int) -> list[float]:
    problem = coverage.drawn(coverage.TRUTH, seed, every=EVERY)
    return coverage.drops(problem, coverage.fitted(problem))


@pytest.fixture(scope="module")
def pool(shelf: Path) -> Iterator[ProcessPoolExecutor]:
    with pytest.MonkeyPatch.context() as patch, ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        patch.setenv("SLIPSTICK_TABLES", str(shelf))
        yield pool


def test_intervals_cover_the_truth_at_their_nominal_rate(pool: ProcessPoolExecutor) -> None:
    """Each unknown and identified combination by its count, and all data sets together by Wilks' chi-square."""
    decades = np.array(list(pool.map(drops, INTERVAL_SEEDS)))
    assert decades.shape[1] > 5
    assert np.all(decades > -0.01)  # the optimum is no less likely than the truth
    covered = np.count_nonzero(decades < drop_at_level(coverage.LEVEL), axis=0)
    assert np.all(covered >= binom.ppf(LOWEST_P, len(INTERVAL_SEEDS), coverage.LEVEL))
    sums = 2 * np.log(10) * decades[:, 5:].sum(axis=0)  # of the combinations
    low, high = chi2.ppf([LOWEST_P, 1 - LOWEST_P], len(INTERVAL_SEEDS))
    assert np.all((low < sums) & (sums < high))


def test_predictions_are_calibrated_and_those_of_a_wrong_family_are_not(pool: ProcessPoolExecutor) -> None:
    assert coverage.predictions(np.array(list(pool.map(coverage.normal_levels, PREDICTION_SEEDS))), PARTS)[0] > LOWEST_P
    assert coverage.predictions(np.array(list(pool.map(coverage.beta_levels, PREDICTION_SEEDS))), PARTS)[0] < 0.01
