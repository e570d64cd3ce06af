"""Draws the list `OVERSEAS` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_overseas

Twelve cases are on each of the benches `drawn85` to `drawn96`. For the strengths see quota.py; those of two effects are
from 20 times the limit, and both are of listed pairs, so that both can be told.
"""

import numpy as np

from .fifteenth import BENCHES, FIFTEENTH
from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS

DRAWN = [f"drawn{number}" for number in range(85, 97)]
TEMPTING = [*TEMPTATIONS] * 2 + ["loud_sensor", "many_bad_runs"]  # of one null of each bench
OVERSEAS = twelve_each(FIFTEENTH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=20.0, two_listed=True)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([113, 163])
    write("overseas", cases(OVERSEAS, random), random, 20000, letter="v")


if __name__ == "__main__":
    main()
