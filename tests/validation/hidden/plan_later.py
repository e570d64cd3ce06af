"""Draws the list `later` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_later

Half of the cases are on the bench `light`. An effect has at most two cases, one of them on `light` and one on the other
bench of `BENCHES` (sixth.py). For the strengths see quota.py.
"""

import numpy as np

from .plan import write
from .quota import Quota, cases
from .sixth import BENCHES, SIXTH

LATER = Quota(
    SIXTH, BENCHES,
    tempted={"light": ("batches", "ambient", "loud_sensor", "many_bad_runs", "thermometer"),
             "heavy": ("ambient", "many_bad_runs"), "brisk": ("batches", "thermometer"), "giant": ("loud_sensor",)},
    plain={"light": 5, "heavy": 1, "brisk": 1, "giant": 3},
    alone={"light": (25, 5, 2), "heavy": (9, 1, 1), "brisk": (8, 2, 1), "giant": (8, 2, 0)},
    pairs={"light": (True, False) * 3, "heavy": (True, False), "brisk": (False, True), "giant": (True, False)},
)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([29, 41])
    write("later", cases(LATER, random), random, 9000, letter="h")


if __name__ == "__main__":
    main()
