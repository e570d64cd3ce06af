"""Some of the fixed cases: what is hidden is drawn, named and judged as before, and nothing where nothing is hidden."""

import csv
from pathlib import Path

import pytest

from evidence import regression
from evidence.runner import answer_case

CASES = [("nothing_missing", 101), ("one_known_effect", 127), ("one_known_effect", 131), ("one_known_effect", 135),
         ("further_channel", 104)]


@pytest.mark.slow
@pytest.mark.parametrize(("suite", "seed"), CASES, ids=str)
def test_the_verdict_is_as_expected(suite: str, seed: int, tmp_path: Path) -> None:
    entry = answer_case("naming", suite, seed, tmp_path)
    assert regression.summarise(entry) == regression.read()[suite, seed]


def test_the_table_has_some_twenty_cases_of_all_suites_by_their_names() -> None:
    with regression.TABLE.open() as file:
        rows = list(csv.DictReader(file))
    assert 18 <= len(rows) <= 24
    assert len({row["suite"] for row in rows}) == 8
    assert all(row["case"].startswith(f"{row['suite']}/") and f"/seed-{row['seed']}" in row["case"] for row in rows)
    assert set(CASES) <= set(regression.read())
