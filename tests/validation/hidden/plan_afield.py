"""Draws the list `AFIELD` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_afield

Twelve cases are on each of the benches `drawn25` to `drawn36`. For the strengths see quota.py.
"""

import numpy as np

from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS
from .tenth import BENCHES, TENTH

DRAWN = [f"drawn{number}" for number in range(25, 37)]
TEMPTING = [*TEMPTATIONS] * 2 + ["batches", "loud_sensor"]  # of one null of each bench
AFIELD = twelve_each(TENTH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)))


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([67, 103])
    write("afield", cases(AFIELD, random), random, 14000, letter="p")


if __name__ == "__main__":
    main()
