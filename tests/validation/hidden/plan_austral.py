"""Draws the list `AUSTRAL` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_austral

Twelve cases are on each of the benches `drawn109` to `drawn120`. For the strengths see quota.py; those of two effects
are from 20 times the limit, and both are of listed pairs, so that both can be told.
"""

import numpy as np

from .plan import write
from .quota import cases, twelve_each
from .seventeenth import BENCHES, SEVENTEENTH
from .temptations import TEMPTATIONS

DRAWN = [f"drawn{number}" for number in range(109, 121)]
TEMPTING = [*TEMPTATIONS] * 2 + ["ambient", "loud_sensor"]  # of one null of each bench
AUSTRAL = twelve_each(SEVENTEENTH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=20.0, two_listed=True)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([131, 179])
    write("austral", cases(AUSTRAL, random), random, 22000, letter="x")


if __name__ == "__main__":
    main()
