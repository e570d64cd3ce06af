"""Draws the list `DISTANT` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_distant

Twelve cases are on each of the benches `drawn73` to `drawn84`. For the strengths see quota.py; those of two effects are
from 20 times the limit, and both are of listed pairs, so that both can be told.
"""

import numpy as np

from .fourteenth import BENCHES, FOURTEENTH
from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS

DRAWN = [f"drawn{number}" for number in range(73, 85)]
TEMPTING = [*TEMPTATIONS] * 2 + ["ambient", "batches"]  # of one null of each bench
DISTANT = twelve_each(FOURTEENTH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=20.0, two_listed=True)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([109, 157])
    write("distant", cases(DISTANT, random), random, 19000, letter="t")


if __name__ == "__main__":
    main()
