"""Draws the list `OUTLYING` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_outlying

Twelve cases are on each of the benches `drawn61` to `drawn72`. For the strengths see quota.py; those of two effects are
from 20 times the limit, and both are of listed pairs, so that both can be told.
"""

import numpy as np

from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS
from .thirteenth import BENCHES, THIRTEENTH

DRAWN = [f"drawn{number}" for number in range(61, 73)]
TEMPTING = [*TEMPTATIONS] * 2 + ["loud_sensor", "thermometer"]  # of one null of each bench
OUTLYING = twelve_each(THIRTEENTH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=20.0, two_listed=True)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([103, 151])
    write("outlying", cases(OUTLYING, random), random, 18000, letter="s")


if __name__ == "__main__":
    main()
