"""The short form of `python -m benchmarks.coverage`: fits to data drawn from the table know what they do not know."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom, chi2

from benchmarks import coverage
from slipstick.uncertainty.fit.intervals import drop_at_level

EVERY = 4  # condition of the table
HELD, DRAWN = range(1, 6), range(201, 209)
PARTS, RARE = 3, 1e-3


def dropped(seed: int) -> list[float]:
    problem = coverage.drawn(coverage.TRUTH, seed, every=EVERY)
    return coverage.drops(problem, coverage.fitted(problem))


@pytest.fixture(scope="module")
def pool(shelf: Path) -> Iterator[ProcessPoolExecutor]:
    with pytest.MonkeyPatch.context() as patch, ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        patch.setenv("SLIPSTICK_TABLES", str(shelf))
        yield pool


def test_intervals_hold_the_truth_as_often_as_they_say(pool: ProcessPoolExecutor) -> None:
    """Each unknown and each identified combination by its count, and all sets together by Wilks' chi-square."""
    drops = np.array(list(pool.map(dropped, HELD)))
    assert drops.shape[1] > 5
    assert np.all(drops > -0.01)  # the fit is no worse than the truth, whatever is held
    held = np.count_nonzero(drops < drop_at_level(coverage.LEVEL), axis=0)
    assert np.all(held >= binom.ppf(RARE, len(HELD), coverage.LEVEL))
    sums = 2 * np.log(10) * drops[:, 5:].sum(axis=0)  # of the combinations
    low, high = chi2.ppf([RARE, 1 - RARE], len(HELD))
    assert np.all((low < sums) & (sums < high))


def test_predictions_come_true_and_those_of_a_wrong_family_do_not(pool: ProcessPoolExecutor) -> None:
    assert coverage.predictions(np.array(list(pool.map(coverage.normal_levels, DRAWN))), PARTS)[0] > RARE
    assert coverage.predictions(np.array(list(pool.map(coverage.beta_levels, DRAWN))), PARTS)[0] < 0.01
