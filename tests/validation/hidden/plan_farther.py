"""Draws the list `FARTHER` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_farther

Twelve cases are on each of the benches `drawn37` to `drawn48`. For the strengths see quota.py; those of two effects are
from 12 times the limit, so that both are visible more often.
"""

import numpy as np

from .eleventh import BENCHES, ELEVENTH
from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS

DRAWN = [f"drawn{number}" for number in range(37, 49)]
TEMPTING = [*TEMPTATIONS] * 2 + ["ambient", "thermometer"]  # of one null of each bench
FARTHER = twelve_each(ELEVENTH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=12.0)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([89, 131])
    write("farther", cases(FARTHER, random), random, 16000, letter="q")


if __name__ == "__main__":
    main()
