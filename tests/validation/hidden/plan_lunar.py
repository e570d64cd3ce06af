"""Draws the list `LUNAR` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_lunar

Twelve cases are on each of the benches `drawn157` to `drawn168`. For the strengths see quota.py; those of two effects
are from 20 times the limit, and both are of listed pairs, so that both can be told.
"""

import numpy as np

from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS
from .twentyfirst import BENCHES, TWENTYFIRST

DRAWN = [f"drawn{number}" for number in range(157, 169)]
TEMPTING = [*TEMPTATIONS] * 2 + ["ambient", "thermometer"]  # of one null of each bench
LUNAR = twelve_each(TWENTYFIRST, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=20.0, two_listed=True)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([167, 199])
    write("lunar", cases(LUNAR, random), random, 26000, letter="b")


if __name__ == "__main__":
    main()
