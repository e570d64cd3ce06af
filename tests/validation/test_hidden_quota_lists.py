"""The lists `FRESH`, `LATER`, `FURTHER` and `BEYOND` of the simulated test benches are as their README states."""

from collections import Counter

import numpy as np
import pytest
from hidden import EFFECTS, INGREDIENTS, LAWS, UNSEEN, Case
from hidden.cases import BEYOND, FRESH, FURTHER, LATER
from hidden.effect import Effect
from hidden.eighth import EIGHTH
from hidden.fifth import FIFTH
from hidden.fourth import FOURTH
from hidden.limits import read as read_limits
from hidden.pairs import LISTED, listed, pair
from hidden.plan import LARGEST_STRENGTH
from hidden.plan_beyond import BEYOND as QUOTA_OF_BEYOND
from hidden.plan_fresh import FRESH as QUOTA_OF_FRESH
from hidden.plan_further import FURTHER as QUOTA_OF_FURTHER
from hidden.plan_later import LATER as QUOTA_OF_LATER
from hidden.quota import Quota
from hidden.seventh import SEVENTH
from hidden.sixth import SIXTH
from hidden.third import THIRD

EARLIER = (*EFFECTS.values(), *UNSEEN, *THIRD, *FOURTH)
LISTS = pytest.mark.parametrize(("cases", "quota"), [(FRESH, QUOTA_OF_FRESH), (LATER, QUOTA_OF_LATER),
                                                     (FURTHER, QUOTA_OF_FURTHER), (BEYOND, QUOTA_OF_BEYOND)],
                                ids=["fresh", "later", "further", "beyond"])
KINDS = (True, False), (False, False), (False, True)  # of `Quota.alone`: listed pair, over a further channel


@pytest.mark.parametrize(("effects", "earlier", "kinds"), [(FIFTH, EARLIER, (36, 9, 3)),
                                                           (SIXTH, (*EARLIER, *FIFTH), (33, 10, 5)),
                                                           (SEVENTH, (*EARLIER, *FIFTH, *SIXTH), (33, 10, 5)),
                                                           (EIGHTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH), (24, 7, 3))])
def test_a_set_of_effects_has_new_ones_of_all_or_of_different_listed_pairs(
        effects: tuple[Effect, ...], earlier: tuple[Effect, ...], kinds: tuple[int, int, int]) -> None:
    own = {effect.name for effect in effects}
    assert len(own) == len(effects) == sum(kinds)
    assert not own & {effect.name for effect in earlier}
    assert len({pair(effect) for effect in effects} & LISTED) == min(len(LISTED), kinds[0])
    assert Counter(map(kind, effects)) == dict(zip(KINDS, kinds, strict=True))


@LISTS
def test_a_list_has_its_own_effects_on_their_benches_in_complete_worlds(cases: dict[str, Case], quota: Quota) -> None:
    assert len(cases) == 96
    slots = [(name, case.bench) for case in cases.values() for name in case.effects]
    assert len(set(slots)) == len(slots)
    assert all(bench in quota.benches[name] for name, bench in slots)
    assert sum(not case.effects for case in cases.values()) == (22 if cases is BEYOND else 20)
    assert all(getattr(case.drawn_world, name) for case in cases.values() for name in INGREDIENTS)
    sizes = Counter(case.count if case.count in (27, 54) else len(case.setup.profile) - case.count
                    for case in cases.values())
    assert sizes == {27: 10, 54: 67, 0: 19} or cases is BEYOND
    assert all(case.count <= len(case.setup.profile) for case in cases.values())


def test_half_of_the_cases_are_on_a_bench_of_its_own() -> None:
    assert Counter(case.bench for case in FRESH.values()) == {"giant": 48, "heavy": 24, "compact": 24}
    assert Counter(case.bench for case in LATER.values()) == {"light": 48, "heavy": 16, "brisk": 16, "giant": 16}
    assert Counter(case.bench for case in FURTHER.values()) == {"slow": 48, "heavy": 16, "compact": 16, "light": 16}


def test_eight_cases_of_the_list_beyond_are_on_each_drawn_bench() -> None:
    assert Counter(case.bench for case in BEYOND.values()) == {f"drawn{number:02}": 8 for number in range(1, 13)}
    alone = Counter(next(iter(case.effects)) for case in BEYOND.values() if len(case.effects) == 1)
    assert {alone[effect.name] for effect in EIGHTH if listed(effect)} == {2, 3}


@LISTS
def test_a_list_has_the_stated_single_effects_and_pairs(cases: dict[str, Case], quota: Quota) -> None:
    alone = [LAWS[next(iter(case.effects))] for case in cases.values() if len(case.effects) == 1]
    assert Counter(map(kind, alone)) == dict(zip(KINDS, (54, 10, 2) if cases is BEYOND else (50, 10, 4), strict=True))
    assert {effect for effect in quota.effects if listed(effect)} <= set(alone)
    pairs = [[LAWS[name] for name in case.effects] for case in cases.values() if len(case.effects) == 2]
    assert Counter(first.block == second.block for first, second in pairs) == dict.fromkeys(
        (True, False), 4 if cases is BEYOND else 6)
    assert all(pair(first) != pair(second) for first, second in pairs)
    assert len({frozenset(map(pair, both)) for both in pairs}) == len(pairs)


@LISTS
def test_strengths_of_a_list_span_the_stated_range(cases: dict[str, Case], quota: Quota) -> None:
    limits, multiples = read_limits(), []
    for case in cases.values():
        for name, strength in case.effects.items():
            assert strength <= LARGEST_STRENGTH * LAWS[name].typical * 1.01
            if len(case.effects) == 1 and listed(LAWS[name]):
                multiples.append(strength / limits[name, case.bench])
    assert 1 < min(multiples) < 2 < 35 < max(multiples) <= 40.2
    assert np.median(multiples) == pytest.approx(np.sqrt(1.5 * 40), rel=0.35)


def kind(effect: Effect) -> tuple[bool, bool]:
    """Return whether an effect is of a listed pair, and whether it is over a further channel."""
    return listed(effect), effect.abscissa == "oil_temperature"
