"""The tests of robustness run for minutes and are not run here, but what they count must be right."""

import csv
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from evidence.robustness import noise
from evidence.robustness.kills import Round, compute_digest, summarize
from evidence.robustness.load import HEALTH, Outcomes
from evidence.robustness.many_jobs import describe
from evidence.robustness.table import HEADER, PATH, Row, replace_rows

ROOT = Path(__file__).parents[2]


def test_all_modules_can_be_imported() -> None:
    names = sorted(path.stem for path in (ROOT / "evidence" / "robustness").glob("[a-z]*.py"))
    assert len(names) > 5
    for name in names:
        import_module(f"evidence.robustness.{name}")


def test_the_committed_table_counts_no_more_right_than_cases() -> None:
    with PATH.open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert tuple(header) == HEADER
    assert {row[0] for row in rows} == {"damaged tables", "foreign files", "kills", "load", "many jobs", "noise",
                                       "readers"}
    for row in (dict(zip(HEADER, row, strict=True)) for row in rows):
        assert (row["cases"] == "") == (row["right"] == "")
        assert int(row["right"] or 0) <= int(row["cases"] or 0), row


def test_a_test_replaces_its_own_rows_only(tmp_path: Path) -> None:
    path = tmp_path / "robustness.csv"
    replace_rows("load", [Row("front page", 3, 2, "requests", "slow")], "python load", path)
    replace_rows("kills", [Row("fits", 1, 1, "jobs", ""), Row("memory", None, None, "", "1 MB")], "python kills", path)
    replace_rows("load", [Row("Ümlaut, quoted", 4, 4, "requests", "fast")], "python load", path)
    with path.open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert tuple(header) == HEADER
    assert [row[:-1] for row in rows] == [["kills", "fits", "1", "1", "jobs", ""],
                                          ["kills", "memory", "", "", "", "1 MB"],
                                          ["load", "Ümlaut, quoted", "4", "4", "requests", "fast"]]
    assert all(row[-1].startswith(f"`python {row[0]}`: ") for row in rows)


def test_a_result_that_differs_in_its_last_digit_counts_as_different_but_not_one_that_took_longer() -> None:
    result = {"id": "a", "seconds": {"search": 1.0}, "result": {"mean": [1.0, 0.1 + 0.2]}}
    assert compute_digest(result) == compute_digest({**result, "id": "b", "seconds": {"search": 9.0}})
    assert compute_digest(result) != compute_digest({**result, "result": {"mean": [1.0, 0.3]}})


def test_the_rounds_of_kills_are_added_by_work_and_database() -> None:
    rounds = [Round(0, "PostgreSQL", "fits", 1, 2, 1, 0, 3, 0, 0, 1),
              Round(1, "PostgreSQL", "fits", 0, 1, 3, 0, 3, 1, 0, 0),
              Round(2, "SQLite", "build", 0, 0, 0, 4, 1, 0, 0, 0)]
    assert summarize(rounds) == [
        Row("fits on PostgreSQL: 8 kills (1 of service, 3 of worker, 4 of database), rounds: 2", 6, 4, "jobs",
            "1 lost, 0 doubled, 1 with another result"),
        Row("build of a table: 4 kills (4 of build), rounds: 1", 1, 1, "jobs",
            "0 lost, 0 doubled, 0 with another result")]


def test_requests_under_load_that_are_told_to_come_back_later_are_no_errors() -> None:
    outcomes = Outcomes([1.0, 2.0, 3.0])
    outcomes.counts.update(expected=3, later=2, error=1)
    row = outcomes.describe(HEALTH)
    assert (row.cases, row.right) == (6, 5)
    assert row.measured == "median 2 ms, 99 % in 2.98 ms, longest 3 ms; 429 or 503: 2"


def test_requests_with_many_jobs_have_the_range_of_their_times() -> None:
    row = describe("lists", [(1.0, 0.5), (2.0, 0.5)], [(10.0, 7.0), (30.0, 7.0)])
    assert row.measured == "1 to 2 ms with one job, 10 to 30 ms with many (7 kB)"


def test_noise_that_is_estimated_too_low_or_too_high_is_not_right() -> None:
    ratios = [noise.Ratio("pressure", signal, blocks) for signal, blocks in ((1.1, 1.0), (0.4, 0.9), (3.0, 1.6))]
    signal, blocks = noise.summarize(ratios)
    assert (signal.cases, signal.right, signal.measured) == (3, 1, "within a factor of 2: 1; worst factor: 3")
    assert (blocks.cases, blocks.right, blocks.measured) == (3, 2, "within a factor of 2: 3; worst factor: 1.6")


def test_power_at_low_frequencies_is_that_of_sums() -> None:
    white = np.random.default_rng(3).standard_normal((400, 2000))
    assert noise.compute_power(2 * white) == pytest.approx(4, rel=0.02)
    assert noise.compute_power(lfilter([1], [1, -0.5], white)) == pytest.approx(4, rel=0.02)  # 1 / (1 - 0.5)^2
