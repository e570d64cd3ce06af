"""Coverage of intervals and predictions on data drawn from the table, a short `python -m benchmarks.coverage`."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom, chi2

from benchmarks import coverage
from slipstick.uncertainty.fit.intervals import drop_at_level

EVERY = 4  # step between the conditions used, of those of the table
INTERVAL_SEEDS, LEAST_COVERED = range(1, 22), 14
"""Seeds of the data sets, and the least number of them in which an interval must contain the truth."""
PREDICTION_SEEDS = range(201, 209)
PARTS, LOWEST_P = 3, 1e-3
SHORT = {"population": 12, "generations": 4}
"""Settings of a short search: it only has to reach the region from which the refinement converges."""


@pytest.fixture(autouse=True)
def _short_fits_of_a_small_table(shelf: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SLIPSTICK_TABLES", str(shelf))
    monkeypatch.setattr(coverage, "SETTINGS", replace(coverage.SETTINGS, **SHORT))


def drops(seed: int) -> list[float]:
    problem = coverage.drawn(coverage.TRUTH, seed, every=EVERY)
    return coverage.drops(problem, coverage.fitted(problem))


def test_the_number_of_data_sets_distinguishes_the_nominal_coverage_from_half_of_it() -> None:
    count, directions = len(INTERVAL_SEEDS), 5 + len(coverage.directions())
    assert directions * binom.cdf(LEAST_COVERED - 1, count, coverage.LEVEL) < 0.01  # bound on false alarms
    assert binom.sf(LEAST_COVERED - 1, count, coverage.LEVEL / 2) < 0.05  # half the coverage passes unnoticed


@pytest.mark.slow
def test_intervals_cover_the_truth_at_their_nominal_rate() -> None:
    """Each unknown and identified combination by its count, and all data sets together by Wilks' chi-square."""
    decades = np.array([drops(seed) for seed in INTERVAL_SEEDS])
    assert decades.shape == (len(INTERVAL_SEEDS), 5 + len(coverage.directions()))
    assert np.all(decades > -0.01)  # the optimum is no less likely than the truth
    covered = np.count_nonzero(decades < drop_at_level(coverage.LEVEL), axis=0)
    assert np.all(covered >= LEAST_COVERED), covered
    sums = 2 * np.log(10) * decades[:, 5:].sum(axis=0)  # of the combinations
    low, high = chi2.ppf([LOWEST_P, 1 - LOWEST_P], len(INTERVAL_SEEDS))
    assert np.all((low < sums) & (sums < high)), sums


@pytest.mark.slow
def test_predictions_are_calibrated_and_those_of_a_wrong_family_are_not() -> None:
    right, wrong = (np.array([levels(seed) for seed in PREDICTION_SEEDS])
                    for levels in (coverage.normal_levels, coverage.beta_levels))
    assert coverage.predictions(right, PARTS)[0] > LOWEST_P
    assert coverage.predictions(wrong, PARTS)[0] < 0.01
