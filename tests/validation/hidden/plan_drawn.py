"""Draws a list of cases.py on twelve drawn benches, from `abroad` on; run once for each, before anything is run on it.

    python -m tests.validation.hidden.plan_drawn LIST

Twelve cases are on each of the benches. For the strengths see quota.py. From `farther` on, those of two effects are
larger, so that both are visible more often, and from `remote` on, both are of listed pairs, so that both can be told.
"""

import argparse
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .forms import BENCHES, FORMS
from .plan import write
from .quota import Quota, cases, twelve_each
from .temptations import TEMPTATIONS


@dataclass(frozen=True)
class Plan:
    """How a list is drawn.

    `name` is that of the list, `letter` that with which its cases begin, `first_bench` the number of its first bench,
    `first_seed` the number before the seeds of its cases, and `more` are the temptations of two nulls that are not
    among the twice five of the other ten.
    """

    name: str
    letter: str
    first_bench: int
    seed: tuple[int, int]
    first_seed: int
    more: tuple[str, str]
    least_of_two: float = 20.0
    two_listed: bool = True

    @cached_property
    def quota(self) -> Quota:
        """What the list has on each bench."""
        benches = (f"drawn{number}" for number in range(self.first_bench, self.first_bench + 12))
        tempting = dict(zip(benches, (*TEMPTATIONS, *TEMPTATIONS, *self.more), strict=True))
        return twelve_each(FORMS[self.name], BENCHES[self.name], tempting, self.least_of_two, self.two_listed)


PLANS = {plan.name: plan for plan in (
    Plan("abroad", "n", 13, (53, 89), 13000, ("ambient", "many_bad_runs"), 4.0, two_listed=False),
    Plan("afield", "p", 25, (67, 103), 14000, ("batches", "loud_sensor"), 4.0, two_listed=False),
    Plan("farther", "q", 37, (89, 131), 16000, ("ambient", "thermometer"), 12.0, two_listed=False),
    Plan("remote", "r", 49, (101, 149), 17000, ("many_bad_runs", "batches")),
    Plan("outlying", "s", 61, (103, 151), 18000, ("loud_sensor", "thermometer")),
    Plan("distant", "t", 73, (109, 157), 19000, ("ambient", "batches")),
    Plan("overseas", "v", 85, (113, 163), 20000, ("loud_sensor", "many_bad_runs")),
    Plan("polar", "w", 97, (127, 173), 21000, ("batches", "thermometer")),
    Plan("austral", "x", 109, (131, 179), 22000, ("ambient", "loud_sensor")),
    Plan("boreal", "y", 121, (137, 181), 23000, ("many_bad_runs", "thermometer")),
    Plan("alpine", "z", 133, (139, 191), 24000, ("ambient", "many_bad_runs")),
    Plan("glacial", "a", 145, (149, 193), 25000, ("batches", "loud_sensor")),
    Plan("lunar", "b", 157, (167, 199), 26000, ("ambient", "thermometer")),
    Plan("solar", "c", 169, (173, 211), 28000, ("batches", "many_bad_runs")))}


def main(name: str) -> None:
    """Draw the list and write it."""
    plan = PLANS[name]
    random = np.random.default_rng(plan.seed)
    write(name, cases(plan.quota, random), random, plan.first_seed, letter=plan.letter)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m tests.validation.hidden.plan_drawn")
    parser.add_argument("list", choices=PLANS)
    main(parser.parse_args().list)
