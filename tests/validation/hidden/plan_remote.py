"""Draws the list `REMOTE` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_remote

Twelve cases are on each of the benches `drawn49` to `drawn60`. For the strengths see quota.py; those of two effects are
from 20 times the limit, and both are of listed pairs, so that both can be told.
"""

import numpy as np

from .plan import write
from .quota import cases, twelve_each
from .temptations import TEMPTATIONS
from .twelfth import BENCHES, TWELFTH

DRAWN = [f"drawn{number}" for number in range(49, 61)]
TEMPTING = [*TEMPTATIONS] * 2 + ["many_bad_runs", "batches"]  # of one null of each bench
REMOTE = twelve_each(TWELFTH, BENCHES, dict(zip(DRAWN, TEMPTING, strict=True)), least_of_two=20.0, two_listed=True)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([101, 149])
    write("remote", cases(REMOTE, random), random, 17000, letter="r")


if __name__ == "__main__":
    main()
