"""Coverage of intervals and predictions on sets drawn from the table, and the rows that coverage gives.

The first are a short `python -m evidence.calibration_coverage fits`.
"""

import csv
from collections.abc import Hashable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom, chi2

from evidence.calibration_coverage import calibrations, coefficients, fits
from evidence.calibration_coverage.__main__ import KINDS
from evidence.calibration_coverage.table import HEADER, PATH, Row, replace_rows
from evidence.kept import run_jobs
from evidence.rates import bounds
from slipstick.uncertainty.fit.intervals import drop_at_level

EVERY = 4  # step between the conditions used, of those of the table
INTERVAL_SEEDS, LEAST_COVERED = range(1, 22), 14
"""Seeds of the sets, and the least number of them in which an interval must contain the truth."""
PREDICTION_SEEDS = range(201, 209)
PARTS, LOWEST_P = 3, 1e-3
SHORT = {"population": 12, "generations": 4}
"""Settings of a short search: it only has to reach the region from which the refinement converges."""


@pytest.fixture
def short_fits(shelf: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fits of a small table with a short search."""
    monkeypatch.setenv("SLIPSTICK_TABLES", str(shelf))
    monkeypatch.setattr(fits, "SETTINGS", replace(fits.SETTINGS, **SHORT))


def compute_drops(seed: int) -> list[float]:
    problem = fits.draw_problem(fits.TRUTH, seed, every=EVERY)
    return fits.compute_drops(problem, fits.fit_vector(problem))


@pytest.mark.usefixtures("short_fits")
def test_the_number_of_sets_distinguishes_the_nominal_coverage_from_half_of_it() -> None:
    count, directions = len(INTERVAL_SEEDS), 5 + len(fits.find_directions())
    assert directions * binom.cdf(LEAST_COVERED - 1, count, fits.LEVEL) < 0.01  # bound on false alarms
    assert binom.sf(LEAST_COVERED - 1, count, fits.LEVEL / 2) < 0.05  # half the coverage passes unnoticed


@pytest.mark.slow
@pytest.mark.usefixtures("short_fits")
def test_intervals_cover_the_truth_at_their_nominal_rate() -> None:
    """Each unknown and identified combination by its count, and all sets together by Wilks' chi-square."""
    decades = np.array([compute_drops(seed) for seed in INTERVAL_SEEDS])
    assert decades.shape == (len(INTERVAL_SEEDS), 5 + len(fits.find_directions()))
    assert np.all(decades > -0.01)  # the optimum is no less likely than the truth
    covered = np.count_nonzero(decades < drop_at_level(fits.LEVEL), axis=0)
    assert np.all(covered >= LEAST_COVERED), covered
    sums = 2 * np.log(10) * decades[:, 5:].sum(axis=0)  # of the combinations
    low, high = chi2.ppf([LOWEST_P, 1 - LOWEST_P], len(INTERVAL_SEEDS))
    assert np.all((low < sums) & (sums < high)), sums


@pytest.mark.slow
@pytest.mark.usefixtures("short_fits")
def test_predictions_are_calibrated_and_those_of_a_wrong_family_are_not() -> None:
    right, wrong = (np.array([fits.predict_levels(fits.draw_problem(truth, seed)) for seed in PREDICTION_SEEDS])
                    for truth in (fits.TRUTH, fits.BETA))
    assert fits.check_levels(right, PARTS)[0] > LOWEST_P
    assert fits.check_levels(wrong, PARTS)[0] < 0.01


@pytest.mark.usefixtures("short_fits")
def test_rows_of_fits_count_drops_below_that_of_the_ends_and_predictions_in_the_middle() -> None:
    directions, end = 5 + len(fits.find_directions()), drop_at_level(fits.LEVEL)
    results: list[dict[str, Any]] = [
        {"kind": "intervals", "drop": [0.9 * end] * directions, "open": [(True, False)] * 5},
        {"kind": "intervals", "drop": [0.9 * end, *[1.1 * end] * (directions - 1)], "open": None}]
    random = np.random.default_rng(1)
    for kind in fits.PREDICTED:
        power = 1.0 if kind.startswith("normal") else 3.0
        results += [{"kind": kind, "levels": (random.random(54) ** power).tolist()} for _ in range(100)]
    rows = fits.make_rows(results)
    assert len(rows) == directions + 3
    assert [row.hits for row in rows[:directions]] == [2, *[1] * (directions - 1)]
    assert rows[0].note == "true value 0.95; open below 1 of 1, above 0"
    assert [(row.sets, row.intervals) for row in rows[directions:]] == [(100, 5400)] * 3
    assert rows[-3].hits / 5400 == pytest.approx(0.6, abs=0.02)
    assert rows[-1].hits / 5400 == pytest.approx(0.8 ** (1 / 3) - 0.2 ** (1 / 3), abs=0.02)
    p_values = [float(row.note.split(";")[0].split()[-1]) for row in rows[directions:]]
    assert p_values[0] > LOWEST_P > p_values[1]


def test_rows_of_calibrations_pool_parameters_and_count_undetermined_ones_apart() -> None:
    def make_result(bench: str, missing: str, covered: list[bool]) -> dict[str, Any]:
        return {"bench": bench, "missing": missing, "free": ["gain", "bias"], "converged": True, "seconds": 2.0,
                "covered": covered, "determined": [True, not missing], "width": [2 * 1.6448536 * 0.1, 0.2],
                "error": [0.1, -0.1], "bound": None if missing else [0.1, 0.1], "scatter": [1.0, 1.0]}

    results = [make_result("heavy", "", [True, False]), make_result("heavy", "", [True, True]),
               make_result("compact", "", [True, True]), make_result("heavy", "pressure", [False, True])]
    rows = calibrations.make_rows(results)
    assert [(row.of, row.sets, row.intervals, row.hits) for row in rows] == [
        ("heavy: gain", 2, 2, 2), ("heavy: bias", 2, 2, 1), ("heavy: all", 2, 4, 3),
        ("compact: gain", 1, 1, 1), ("compact: bias", 1, 1, 1), ("compact: all", 1, 2, 2),
        ("heavy without pressure: determined", 1, 1, 0), ("heavy without pressure: not determined", 1, 1, 1)]
    assert rows[0].note.startswith("median width / Cramer-Rao 1.000; error / Cramer-Rao: mean 1.000, std 0.000;")
    assert rows[-1].note == "bias; 1 of 1 converged"


def test_rows_of_coefficients_leave_out_studies_without_a_formula() -> None:
    drag, droop = "quadratic_load_drag", "supply_droop"
    rows = coefficients.make_rows([
        {"effect": drag, "named": True, "true": 2.0, "interval": [1.0, 1.5, 2.5]},
        {"effect": drag, "named": True, "true": 2.0, "interval": [2.1, 2.2, 2.3]},
        {"effect": droop, "named": False, "true": 1.0, "interval": None}])
    counts = {row.of: (row.sets, row.intervals, row.hits) for row in rows}
    assert (counts[drag], counts[droop], counts["all"]) == ((2, 2, 1), (1, 0, 0), (3, 2, 1))
    assert next(row.note for row in rows if row.of == droop) == "named in 0 of 1 studies"


def test_a_kind_replaces_its_own_rows_only_and_without_intervals_there_is_no_share(tmp_path: Path) -> None:
    path = tmp_path / "coverage.csv"
    replace_rows("fits", [Row("mean", 4, 4, 3, "")], "python old", path)
    replace_rows("coefficients", [Row("drag", 3, 0, 0, "none")], "python coefficients", path)
    replace_rows("fits", [Row("mean", 10, 10, 9, "again")], "python fits", path)
    lower, upper = (f"{bound:.3f}" for bound in bounds(9, 10))
    assert (lower, upper) == ("0.555", "0.997")  # Clopper and Pearson, from tables
    with path.open(newline="", encoding="utf-8") as file:
        assert list(csv.reader(file)) == [
            [*HEADER], ["coefficients", "drag", "3", "0", "0", "", "", "", "none"],
            ["coefficients", "made by", *[""] * 6, "python coefficients"],
            ["fits", "mean", "10", "10", "9", "0.900", lower, upper, "again"],
            ["fits", "made by", *[""] * 6, "python fits"]]


def test_the_committed_table_has_the_shares_and_bounds_of_its_counts() -> None:
    with PATH.open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert tuple(header) == HEADER
    assert {row[0] for row in rows} == {*KINDS}
    assert len(rows) < 46
    for kind, of, *counts, share, lower, upper, note in rows:
        if of != "made by":
            assert [kind, *Row(of, *map(int, counts), note).cells()] == [kind, of, *counts, share, lower, upper, note]


def square(number: int) -> dict[str, Any]:
    return {"square": number**2}


def test_jobs_that_are_done_are_not_run_again(tmp_path: Path) -> None:
    kept, jobs = tmp_path / "kept.jsonl", list[tuple[Hashable, ...]]([(2,), (3,)])
    kept.write_text('{"job": [2], "result": {"square": -4}}\n')
    assert dict(run_jobs(square, jobs, kept, ThreadPoolExecutor)) == {(2,): {"square": -4}, (3,): {"square": 9}}
    assert len(kept.read_text().splitlines()) == 2
