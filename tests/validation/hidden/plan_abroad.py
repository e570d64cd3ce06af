"""Draws the list `ABROAD` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_abroad

Twelve cases are on each of the benches `drawn13` to `drawn24`. For the strengths see quota.py.
"""

import numpy as np

from .ninth import BENCHES, NINTH
from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS

DRAWN = [f"drawn{number}" for number in range(13, 25)]
TEMPTING = [*TEMPTATIONS] * 2 + ["ambient", "many_bad_runs"]  # of one null of each bench
ABROAD = twelve_each(NINTH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)))


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([53, 89])
    write("abroad", cases(ABROAD, random), random, 13000, letter="n")


if __name__ == "__main__":
    main()
