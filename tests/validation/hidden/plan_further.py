"""Draws the list `further` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_further

Half of the cases are on the bench `slow`. An effect has at most two cases, one of them on `slow` and one on the other
bench of `BENCHES` (seventh.py). For the strengths see quota.py.
"""

import numpy as np

from .plan import write
from .quota import Quota, cases
from .seventh import BENCHES, SEVENTH

FURTHER = Quota(
    SEVENTH, BENCHES,
    tempted={"slow": ("batches", "ambient", "loud_sensor", "many_bad_runs", "thermometer"),
             "heavy": ("ambient", "many_bad_runs"), "compact": ("batches", "thermometer"), "light": ("loud_sensor",)},
    plain={"slow": 5, "heavy": 1, "compact": 1, "light": 3},
    alone={"slow": (25, 5, 2), "heavy": (9, 1, 1), "compact": (8, 2, 1), "light": (8, 2, 0)},
    pairs={"slow": (True, False) * 3, "heavy": (True, False), "compact": (False, True), "light": (True, False)},
)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([31, 53])
    write("further", cases(FURTHER, random), random, 10000, letter="k")


if __name__ == "__main__":
    main()
