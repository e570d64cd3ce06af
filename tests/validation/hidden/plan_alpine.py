"""Draws the list `ALPINE` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_alpine

Twelve cases are on each of the benches `drawn133` to `drawn144`. For the strengths see quota.py; those of two effects
are from 20 times the limit, and both are of listed pairs, so that both can be told.
"""

import numpy as np

from .nineteenth import BENCHES, NINETEENTH
from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS

DRAWN = [f"drawn{number}" for number in range(133, 145)]
TEMPTING = [*TEMPTATIONS] * 2 + ["ambient", "many_bad_runs"]  # of one null of each bench
ALPINE = twelve_each(NINETEENTH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=20.0, two_listed=True)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([139, 191])
    write("alpine", cases(ALPINE, random), random, 24000, letter="z")


if __name__ == "__main__":
    main()
