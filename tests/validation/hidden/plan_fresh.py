"""Draws the list `fresh` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_fresh

Half of the cases are on the bench `giant`. An effect has at most two cases, one of them on `giant` and one on the other
bench of `BENCHES` (fifth.py). For the strengths see quota.py.
"""

import numpy as np

from .fifth import BENCHES, FIFTH
from .plan import write
from .quota import Quota, cases

FRESH = Quota(
    FIFTH, BENCHES,
    tempted={"giant": ("batches", "ambient", "loud_sensor", "many_bad_runs", "thermometer"),
             "heavy": ("batches", "loud_sensor", "thermometer"), "compact": ("ambient", "many_bad_runs")},
    plain={"giant": 5, "heavy": 2, "compact": 3},
    alone={"giant": (25, 5, 2), "heavy": (13, 2, 1), "compact": (12, 3, 1)},
    pairs={"giant": (True, False) * 3, "heavy": (True, False, True), "compact": (False, True, False)},
)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([23, 17])
    write("fresh", cases(FRESH, random), random, 8000, letter="g")


if __name__ == "__main__":
    main()
