"""Draws the list `AFIELD` of cases.py; run once, before anything is run on it.

    python -m tests.validation.hidden.plan_afield

Twelve cases are on each of the benches `drawn25` to `drawn36`. For the strengths see quota.py.
"""

import numpy as np

from .plan import write
from .quota import Quota, cases
from .temptations import TEMPTATIONS
from .tenth import BENCHES, TENTH

DRAWN = [f"drawn{number}" for number in range(25, 37)]
TEMPTING = [*TEMPTATIONS] * 2 + ["batches", "loud_sensor"]  # of one null of each bench
AFIELD = Quota(
    TENTH, BENCHES,
    tempted={bench: (name,) for bench, name in zip(DRAWN, TEMPTING, strict=True)},
    plain=dict.fromkeys(DRAWN, 1),
    alone={bench: (7, 1, int(i % 3 == 0)) for i, bench in enumerate(DRAWN)},
    pairs={bench: (i % 2 == 0,) if i % 3 == 0 else (True, False) for i, bench in enumerate(DRAWN)},
    least=(3.0, 4.0, 5.0), least_of_two=4.0, most=60.0, counts=(27,) * 14 + (54,) * 100 + (0,) * 30,
)


def main() -> None:
    """Draw the list and write it."""
    random = np.random.default_rng([67, 103])
    write("afield", cases(AFIELD, random), random, 14000, letter="p")


if __name__ == "__main__":
    main()
