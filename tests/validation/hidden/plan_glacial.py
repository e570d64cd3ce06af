"""Draws the list `GLACIAL` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_glacial

Twelve cases are on each of the benches `drawn145` to `drawn156`. For the strengths see quota.py; those of two effects
are from 20 times the limit, and both are of listed pairs, so that both can be told.
"""

import numpy as np

from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS
from .twentieth import BENCHES, TWENTIETH

DRAWN = [f"drawn{number}" for number in range(145, 157)]
TEMPTING = [*TEMPTATIONS] * 2 + ["batches", "loud_sensor"]  # of one null of each bench
GLACIAL = twelve_each(TWENTIETH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=20.0, two_listed=True)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([149, 193])
    write("glacial", cases(GLACIAL, random), random, 25000, letter="a")


if __name__ == "__main__":
    main()
