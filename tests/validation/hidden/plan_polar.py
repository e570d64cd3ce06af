"""Draws the list `POLAR` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_polar

Twelve cases are on each of the benches `drawn97` to `drawn108`. For the strengths see quota.py; those of two effects
are from 20 times the limit, and both are of listed pairs, so that both can be told.
"""

import numpy as np

from .plan import write
from .quota import cases, twelve_each
from .sixteenth import BENCHES, SIXTEENTH
from .temptations import TEMPTATIONS

DRAWN = [f"drawn{number}" for number in range(97, 109)]
TEMPTING = [*TEMPTATIONS] * 2 + ["batches", "thermometer"]  # of one null of each bench
POLAR = twelve_each(SIXTEENTH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=20.0, two_listed=True)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([127, 173])
    write("polar", cases(POLAR, random), random, 21000, letter="w")


if __name__ == "__main__":
    main()
