"""The lists from `fresh` to `solar` of the simulated test benches are as their README states."""

from collections import Counter
from dataclasses import dataclass
from itertools import chain, takewhile

import numpy as np
import pytest
from hidden import EFFECTS, INGREDIENTS, LAWS
from hidden.cases import LISTS
from hidden.effect import Effect
from hidden.forms import FORMS, ON_DRAWN
from hidden.limits import read as read_limits
from hidden.pairs import LISTED, listed, pair
from hidden.plan import LARGEST_STRENGTH
from hidden.plan_beyond import BEYOND
from hidden.plan_drawn import PLANS
from hidden.plan_fresh import FRESH
from hidden.plan_further import FURTHER
from hidden.plan_later import LATER
from hidden.quota import cases as draw

QUOTAS = {"fresh": FRESH, "later": LATER, "further": FURTHER, "beyond": BEYOND,
          **{which: plan.quota for which, plan in PLANS.items()}}
KINDS = (True, False), (False, False), (False, True)  # of `Quota.alone`: listed pair, over a further channel
REPEATED = {"abroad": 2, "remote": 1, "distant": 2, "overseas": 2, "boreal": 1, "alpine": 1, "lunar": 1, "solar": 1}


@dataclass(frozen=True)
class Stated:
    """Numbers of nulls, of single effects of each kind, and of pairs in one block and not in one; multiples of limits.

    `repeated` is the number of pairs that an earlier case has on another bench. `sizes` are the numbers of cases with
    27, 54 and all runs, where every bench has more than 54.
    """

    nulls: int = 20
    alone: tuple[int, int, int] = (50, 10, 4)
    pairs: int = 6
    repeated: int = 0
    sizes: tuple[int, int, int] | None = (10, 67, 19)
    least: float = 1.5
    most: float = 40.0


STATED = dict.fromkeys(("fresh", "later", "further"), Stated()) | {
    "beyond": Stated(nulls=22, alone=(54, 10, 2), pairs=4, sizes=None),
    **{which: Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=REPEATED.get(which, 0), sizes=None, least=3.0,
                     most=60.0) for which in PLANS}}
OF_EACH_KIND = {"fresh": (36, 9, 3), "later": (33, 10, 5), "further": (33, 10, 5), "beyond": (24, 7, 3),
                "abroad": (25, 7, 3)}  # those of the other lists are (27, 8, 3)


def test_every_list_is_tested() -> None:
    assert list(QUOTAS) == list(STATED) == list(FORMS)[3:]
    assert list(PLANS) == list(ON_DRAWN)[1:]


@pytest.mark.parametrize("which", QUOTAS)
def test_a_set_of_effects_has_new_ones_of_all_or_of_different_listed_pairs(which: str) -> None:
    effects, kinds = FORMS[which], OF_EACH_KIND.get(which, (27, 8, 3))
    earlier = chain(EFFECTS.values(), *(FORMS[other] for other in takewhile(lambda other: other != which, FORMS)))
    own = {effect.name for effect in effects}
    assert len(own) == len(effects) == sum(kinds)
    assert not own & {effect.name for effect in earlier}
    assert len({pair(effect) for effect in effects} & LISTED) == min(len(LISTED), kinds[0])
    assert Counter(map(kind, effects)) == dict(zip(KINDS, kinds, strict=True))


@pytest.mark.parametrize("which", QUOTAS)
def test_a_list_has_its_own_effects_on_their_benches_in_complete_worlds(which: str) -> None:
    cases, quota, stated = LISTS[which], QUOTAS[which], STATED[which]
    assert len(cases) == stated.nulls + sum(stated.alone) + 2 * stated.pairs == len(quota.counts)
    slots = [(name, case.bench) for case in cases.values() for name in case.effects]
    assert len(set(slots)) == len(slots)
    assert all(bench in quota.benches[name] for name, bench in slots)
    assert sum(not case.effects for case in cases.values()) == stated.nulls
    assert all(getattr(case.drawn_world, name) for case in cases.values() for name in INGREDIENTS)
    sizes = Counter(case.count if case.count in (27, 54) else len(case.setup.profile) - case.count
                    for case in cases.values())
    assert stated.sizes is None or sizes == dict(zip((27, 54, 0), stated.sizes, strict=True))
    assert set(sizes) == {27, 54, 0}
    assert all(case.count <= len(case.setup.profile) for case in cases.values())


def test_half_of_the_cases_are_on_a_bench_of_its_own() -> None:
    stated = {"fresh": {"giant": 48, "heavy": 24, "compact": 24},
              "later": {"light": 48, "heavy": 16, "brisk": 16, "giant": 16},
              "further": {"slow": 48, "heavy": 16, "compact": 16, "light": 16}}
    for which, counts in stated.items():
        assert Counter(case.bench for case in LISTS[which].values()) == counts


def test_eight_cases_of_the_list_beyond_are_on_each_drawn_bench() -> None:
    cases = LISTS["beyond"].values()
    assert Counter(case.bench for case in cases) == {f"drawn{number:02}": 8 for number in range(1, 13)}
    alone = Counter(next(iter(case.effects)) for case in cases if len(case.effects) == 1)
    assert {alone[effect.name] for effect in FORMS["beyond"] if listed(effect)} == {2, 3}


@pytest.mark.parametrize("which", PLANS)
def test_twelve_cases_of_a_list_are_on_each_bench_drawn_later(which: str) -> None:
    cases, first = LISTS[which], 13 + 12 * list(PLANS).index(which)
    benches = [f"drawn{number}" for number in range(first, first + 12)]
    assert Counter(case.bench for case in cases.values()) == dict.fromkeys(benches, 12)
    alone = [(next(iter(case.effects)), case.bench) for case in cases.values() if len(case.effects) == 1]
    assert Counter(bench for name, bench in alone if listed(LAWS[name])) == dict.fromkeys(benches, 7)
    assert set(Counter(name for name, _ in alone if listed(LAWS[name])).values()) == {3, 4}


@pytest.mark.parametrize("which", QUOTAS)
def test_a_list_has_the_stated_single_effects_and_pairs(which: str) -> None:
    cases, quota, stated = LISTS[which], QUOTAS[which], STATED[which]
    alone = [LAWS[next(iter(case.effects))] for case in cases.values() if len(case.effects) == 1]
    assert Counter(map(kind, alone)) == dict(zip(KINDS, stated.alone, strict=True))
    assert {effect for effect in quota.effects if listed(effect)} <= set(alone)
    pairs = [[LAWS[name] for name in case.effects] for case in cases.values() if len(case.effects) == 2]
    assert Counter(first.block == second.block for first, second in pairs) == dict.fromkeys(
        (True, False), stated.pairs)
    assert all(pair(first) != pair(second) for first, second in pairs)
    assert len({frozenset(map(pair, both)) for both in pairs}) == len(pairs) - stated.repeated


@pytest.mark.parametrize("which", QUOTAS)
def test_strengths_of_a_list_span_the_stated_range(which: str) -> None:
    limits, multiples = read_limits(), []
    for case in LISTS[which].values():
        for name, strength in case.effects.items():
            assert strength <= LARGEST_STRENGTH * LAWS[name].typical * 1.01
            if len(case.effects) == 1 and listed(LAWS[name]):
                multiples.append(strength / limits[name, case.bench])
    least, most = STATED[which].least, STATED[which].most
    assert least / 1.5 < min(multiples) < 1.3 * least < 0.87 * most < max(multiples) <= 1.005 * most
    assert np.median(multiples) == pytest.approx(np.sqrt(least * most), rel=0.35)


@pytest.mark.parametrize("which", PLANS)
def test_a_list_is_drawn_as_it_was(which: str) -> None:
    drawn = Counter((bench, count, frozenset(strengths)) for bench, _, count, strengths
                    in draw(QUOTAS[which], np.random.default_rng(PLANS[which].seed)))
    assert Counter((case.bench, case.count, frozenset(case.effects)) for case in LISTS[which].values()) == drawn


@pytest.mark.parametrize("which", list(PLANS)[list(PLANS).index("remote"):])
def test_both_effects_of_a_case_of_the_last_lists_are_of_listed_pairs_and_visible(which: str) -> None:
    limits = read_limits()
    pairs = [(LAWS[name], strength / limits[name, case.bench]) for case in LISTS[which].values()
             if len(case.effects) == 2 for name, strength in case.effects.items()]
    assert all(listed(effect) and multiple > 20 for effect, multiple in pairs)
    assert not all(listed(LAWS[name]) for case in LISTS["farther"].values()
                   if len(case.effects) == 2 for name in case.effects)


def kind(effect: Effect) -> tuple[bool, bool]:
    """Return whether an effect is of a listed pair, and whether it is over a further channel."""
    return listed(effect), effect.abscissa == "oil_temperature"
