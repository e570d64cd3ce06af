"""Draws the list `beyond` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_beyond

Eight cases are on each drawn bench. For the strengths see quota.py.
"""

import numpy as np

from .eighth import BENCHES, EIGHTH
from .plan import write
from .quota import Quota, cases
from .temptations import TEMPTATIONS

DRAWN = [f"drawn{number:02}" for number in range(1, 13)]
TEMPTING = [*TEMPTATIONS] * 2 + ["batches"]  # of one null of each bench except the last
BEYOND = Quota(
    EIGHTH, BENCHES,
    tempted={bench: (name,) for bench, name in zip(DRAWN, TEMPTING, strict=False)} | {DRAWN[-1]: ()},
    plain=dict(zip(DRAWN, (1, 1, 1, 1, 1, 1, 0, 0, 1, 1, 1, 2), strict=True)),
    alone=dict(zip(DRAWN, [(4, 1, 0)] * 6 + [(5, 1, 0)] * 4 + [(5, 0, 1)] * 2, strict=True)),
    pairs={bench: (i % 2 == 0,) if i < 8 else () for i, bench in enumerate(DRAWN)},
)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([41, 67])
    write("beyond", cases(BEYOND, random), random, 12000, letter="m")


if __name__ == "__main__":
    main()
