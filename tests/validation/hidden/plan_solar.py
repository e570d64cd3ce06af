"""Draws the list `SOLAR` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_solar

Twelve cases are on each of the benches `drawn169` to `drawn180`. For the strengths see quota.py; those of two effects
are from 20 times the limit, and both are of listed pairs, so that both can be told.
"""

import numpy as np

from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS
from .twentysecond import BENCHES, TWENTYSECOND

DRAWN = [f"drawn{number}" for number in range(169, 181)]
TEMPTING = [*TEMPTATIONS] * 2 + ["batches", "many_bad_runs"]  # of one null of each bench
SOLAR = twelve_each(TWENTYSECOND, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=20.0, two_listed=True)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([173, 211])
    write("solar", cases(SOLAR, random), random, 28000, letter="c")


if __name__ == "__main__":
    main()
