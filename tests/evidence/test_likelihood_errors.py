"""The errors that are stated for likelihoods hold on drawn models; the committed table says the same."""

import csv

import numpy as np
import pytest

from evidence.likelihood_errors import DISTANCES, GROUPS, METHODS, TABLE, run_case


def rows() -> list[dict[str, str]]:
    with TABLE.open() as file:
        return list(csv.DictReader(file))


def test_the_table_has_all_methods_and_its_errors_hold() -> None:
    table = rows()
    assert len(table) == len(METHODS) * len(GROUPS) * len(DISTANCES)
    for method in METHODS:
        cases = [row for row in table if row["method"] == method]
        within = sum(int(row["within the stated error"]) for row in cases)
        stated = sum(int(row["cases"]) - int(row["refused"]) for row in cases)
        assert within >= 0.95 * stated


@pytest.mark.parametrize(("group", "models"), [
    ("table of 1 or 2", 2), ("1 or 2", 4), pytest.param("3 to 7", 4, marks=pytest.mark.slow)])
def test_stated_errors_hold_on_fresh_models(group: str, models: int) -> None:
    errors = np.array([run_case(group, distance, 1000 + seed) for distance in (0, 4) for seed in range(models)])
    assert np.mean(errors[:, :, 0] <= errors[:, :, 1]) >= 0.85
    # Negative control: a tenth of the stated errors of samples would not hold as often.
    assert np.mean(errors[:, 3, 0] <= 0.1 * errors[:, 3, 1]) < 0.7
