"""The list `FRESH` of the simulated test benches is as its README states."""

from collections import Counter

import numpy as np
import pytest
from hidden import EFFECTS, INGREDIENTS, LAWS, UNSEEN
from hidden.cases import FRESH
from hidden.fifth import BENCHES, FIFTH
from hidden.fourth import FOURTH
from hidden.limits import read as read_limits
from hidden.pairs import LISTED, listed, pair
from hidden.plan import LARGEST_STRENGTH
from hidden.third import THIRD


def test_the_fresh_list_has_only_effects_of_its_own() -> None:
    cases, own = list(FRESH.values()), {effect.name for effect in FIFTH}
    assert len(own) == len(FIFTH) == 48
    assert not own & {effect.name for effect in (*EFFECTS.values(), *UNSEEN, *THIRD, *FOURTH)}
    assert {pair(effect) for effect in FIFTH} >= LISTED
    assert Counter((listed(effect), effect.abscissa == "oil_temperature") for effect in FIFTH) == {
        (True, False): 36, (False, False): 9, (False, True): 3}
    slots = [(name, case.bench) for case in cases for name in case.effects]
    assert len(set(slots)) == len(slots)
    assert all(bench in BENCHES[name] for name, bench in slots)
    assert Counter(case.bench for case in cases) == {"giant": 48, "heavy": 24, "compact": 24}
    assert sum(not case.effects for case in cases) == 20
    assert all(getattr(case.drawn_world, name) for case in cases for name in INGREDIENTS)
    sizes = Counter(case.count if case.count in (27, 54) else len(case.setup.profile) - case.count for case in cases)
    assert sizes == {27: 10, 54: 67, 0: 19}


def test_the_fresh_list_has_the_stated_single_effects_and_pairs() -> None:
    cases = list(FRESH.values())
    alone = [LAWS[next(iter(case.effects))] for case in cases if len(case.effects) == 1]
    assert Counter((listed(effect), effect.abscissa == "oil_temperature") for effect in alone) == {
        (True, False): 50, (False, False): 10, (False, True): 4}
    assert {effect for effect in FIFTH if listed(effect)} <= set(alone)
    pairs = [[LAWS[name] for name in case.effects] for case in cases if len(case.effects) == 2]
    assert Counter(first.block == second.block for first, second in pairs) == {True: 6, False: 6}
    assert all(pair(first) != pair(second) for first, second in pairs)
    assert len({frozenset(map(pair, both)) for both in pairs}) == len(pairs)


def test_strengths_of_the_fresh_list_span_the_stated_range() -> None:
    limits, multiples = read_limits(), []
    for case in FRESH.values():
        for name, strength in case.effects.items():
            assert strength <= LARGEST_STRENGTH * LAWS[name].typical * 1.01
            if len(case.effects) == 1 and listed(LAWS[name]):
                multiples.append(strength / limits[name, case.bench])
    assert 1 < min(multiples) < 2 < 35 < max(multiples) <= 40.2
    assert np.median(multiples) == pytest.approx(np.sqrt(1.5 * 40), rel=0.35)
