"""Draws the list `ABROAD` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_abroad

Twelve cases are on each of the benches `drawn13` to `drawn24`. For the strengths see quota.py.
"""

import numpy as np

from .ninth import BENCHES, NINTH
from .plan import write
from .quota import Quota, cases
from .temptations import TEMPTATIONS

DRAWN = [f"drawn{number}" for number in range(13, 25)]
TEMPTING = [*TEMPTATIONS] * 2 + ["ambient", "many_bad_runs"]  # of one null of each bench
ABROAD = Quota(
    NINTH, BENCHES,
    tempted={bench: (name,) for bench, name in zip(DRAWN, TEMPTING, strict=True)},
    plain=dict.fromkeys(DRAWN, 1),
    alone={bench: (7, 1, int(i % 3 == 0)) for i, bench in enumerate(DRAWN)},
    pairs={bench: (i % 2 == 0,) if i % 3 == 0 else (True, False) for i, bench in enumerate(DRAWN)},
    least=(3.0, 4.0, 5.0), least_of_two=4.0, most=60.0, counts=(27,) * 14 + (54,) * 100 + (0,) * 30,
)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([53, 89])
    write("abroad", cases(ABROAD, random), random, 13000, letter="n")


if __name__ == "__main__":
    main()
