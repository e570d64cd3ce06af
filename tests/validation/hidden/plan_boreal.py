"""Draws the list `BOREAL` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_boreal

Twelve cases are on each of the benches `drawn121` to `drawn132`. For the strengths see quota.py; those of two effects
are from 20 times the limit, and both are of listed pairs, so that both can be told.
"""

import numpy as np

from .eighteenth import BENCHES, EIGHTEENTH
from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS

DRAWN = [f"drawn{number}" for number in range(121, 133)]
TEMPTING = [*TEMPTATIONS] * 2 + ["many_bad_runs", "thermometer"]  # of one null of each bench
BOREAL = twelve_each(EIGHTEENTH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=20.0, two_listed=True)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([137, 181])
    write("boreal", cases(BOREAL, random), random, 23000, letter="y")


if __name__ == "__main__":
    main()
