"""The lists from `FRESH` to `SOLAR` of the simulated test benches are as their README states."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pytest
from hidden import EFFECTS, INGREDIENTS, LAWS, UNSEEN, Case
from hidden.cases import (
    ABROAD,
    AFIELD,
    ALPINE,
    AUSTRAL,
    BEYOND,
    BOREAL,
    DISTANT,
    FARTHER,
    FRESH,
    FURTHER,
    GLACIAL,
    LATER,
    LUNAR,
    OUTLYING,
    OVERSEAS,
    POLAR,
    REMOTE,
    SOLAR,
)
from hidden.effect import Effect
from hidden.eighteenth import EIGHTEENTH
from hidden.eighth import EIGHTH
from hidden.eleventh import ELEVENTH
from hidden.fifteenth import FIFTEENTH
from hidden.fifth import FIFTH
from hidden.fourteenth import FOURTEENTH
from hidden.fourth import FOURTH
from hidden.limits import read as read_limits
from hidden.nineteenth import NINETEENTH
from hidden.ninth import NINTH
from hidden.pairs import LISTED, listed, pair
from hidden.plan import LARGEST_STRENGTH
from hidden.plan_abroad import ABROAD as QUOTA_OF_ABROAD
from hidden.plan_afield import AFIELD as QUOTA_OF_AFIELD
from hidden.plan_alpine import ALPINE as QUOTA_OF_ALPINE
from hidden.plan_austral import AUSTRAL as QUOTA_OF_AUSTRAL
from hidden.plan_beyond import BEYOND as QUOTA_OF_BEYOND
from hidden.plan_boreal import BOREAL as QUOTA_OF_BOREAL
from hidden.plan_distant import DISTANT as QUOTA_OF_DISTANT
from hidden.plan_farther import FARTHER as QUOTA_OF_FARTHER
from hidden.plan_fresh import FRESH as QUOTA_OF_FRESH
from hidden.plan_further import FURTHER as QUOTA_OF_FURTHER
from hidden.plan_glacial import GLACIAL as QUOTA_OF_GLACIAL
from hidden.plan_later import LATER as QUOTA_OF_LATER
from hidden.plan_lunar import LUNAR as QUOTA_OF_LUNAR
from hidden.plan_outlying import OUTLYING as QUOTA_OF_OUTLYING
from hidden.plan_overseas import OVERSEAS as QUOTA_OF_OVERSEAS
from hidden.plan_polar import POLAR as QUOTA_OF_POLAR
from hidden.plan_remote import REMOTE as QUOTA_OF_REMOTE
from hidden.plan_solar import SOLAR as QUOTA_OF_SOLAR
from hidden.quota import Quota
from hidden.quota import cases as draw
from hidden.seventeenth import SEVENTEENTH
from hidden.seventh import SEVENTH
from hidden.sixteenth import SIXTEENTH
from hidden.sixth import SIXTH
from hidden.tenth import TENTH
from hidden.third import THIRD
from hidden.thirteenth import THIRTEENTH
from hidden.twelfth import TWELFTH
from hidden.twentieth import TWENTIETH
from hidden.twentyfirst import TWENTYFIRST
from hidden.twentysecond import TWENTYSECOND

EARLIER = (*EFFECTS.values(), *UNSEEN, *THIRD, *FOURTH)
KINDS = (True, False), (False, False), (False, True)  # of `Quota.alone`: listed pair, over a further channel


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


OF_BEYOND = Stated(nulls=22, alone=(54, 10, 2), pairs=4, sizes=None)
OF_ABROAD = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=2, sizes=None, least=3.0, most=60.0)
OF_AFIELD = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=0, sizes=None, least=3.0, most=60.0)
OF_FARTHER = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=0, sizes=None, least=3.0, most=60.0)
OF_REMOTE = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=1, sizes=None, least=3.0, most=60.0)
OF_OUTLYING = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=0, sizes=None, least=3.0, most=60.0)
OF_DISTANT = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=2, sizes=None, least=3.0, most=60.0)
OF_OVERSEAS = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=2, sizes=None, least=3.0, most=60.0)
OF_POLAR = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=0, sizes=None, least=3.0, most=60.0)
OF_AUSTRAL = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=0, sizes=None, least=3.0, most=60.0)
OF_BOREAL = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=1, sizes=None, least=3.0, most=60.0)
OF_ALPINE = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=1, sizes=None, least=3.0, most=60.0)
OF_GLACIAL = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=0, sizes=None, least=3.0, most=60.0)
OF_LUNAR = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=1, sizes=None, least=3.0, most=60.0)
OF_SOLAR = Stated(nulls=24, alone=(84, 12, 4), pairs=10, repeated=1, sizes=None, least=3.0, most=60.0)
LISTS = pytest.mark.parametrize(
    ("cases", "quota", "stated"),
    [(FRESH, QUOTA_OF_FRESH, Stated()), (LATER, QUOTA_OF_LATER, Stated()), (FURTHER, QUOTA_OF_FURTHER, Stated()),
     (BEYOND, QUOTA_OF_BEYOND, OF_BEYOND), (ABROAD, QUOTA_OF_ABROAD, OF_ABROAD),
     (AFIELD, QUOTA_OF_AFIELD, OF_AFIELD), (FARTHER, QUOTA_OF_FARTHER, OF_FARTHER),
     (REMOTE, QUOTA_OF_REMOTE, OF_REMOTE), (OUTLYING, QUOTA_OF_OUTLYING, OF_OUTLYING),
     (DISTANT, QUOTA_OF_DISTANT, OF_DISTANT), (OVERSEAS, QUOTA_OF_OVERSEAS, OF_OVERSEAS),
     (POLAR, QUOTA_OF_POLAR, OF_POLAR), (AUSTRAL, QUOTA_OF_AUSTRAL, OF_AUSTRAL),
     (BOREAL, QUOTA_OF_BOREAL, OF_BOREAL), (ALPINE, QUOTA_OF_ALPINE, OF_ALPINE),
     (GLACIAL, QUOTA_OF_GLACIAL, OF_GLACIAL), (LUNAR, QUOTA_OF_LUNAR, OF_LUNAR),
     (SOLAR, QUOTA_OF_SOLAR, OF_SOLAR)],
    ids=["fresh", "later", "further", "beyond", "abroad", "afield", "farther", "remote", "outlying",
         "distant", "overseas", "polar", "austral", "boreal", "alpine", "glacial", "lunar",
         "solar"])


@pytest.mark.parametrize(("effects", "earlier", "kinds"), [(FIFTH, EARLIER, (36, 9, 3)),
                                                           (SIXTH, (*EARLIER, *FIFTH), (33, 10, 5)),
                                                           (SEVENTH, (*EARLIER, *FIFTH, *SIXTH), (33, 10, 5)),
                                                           (EIGHTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH), (24, 7, 3)),
                                                           (NINTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH),
                                                            (25, 7, 3)),
                                                           (TENTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                    *NINTH), (27, 8, 3)),
                                                           (ELEVENTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                       *NINTH, *TENTH), (27, 8, 3)),
                                                           (TWELFTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                      *NINTH, *TENTH, *ELEVENTH), (27, 8, 3)),
                                                           (THIRTEENTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                         *NINTH, *TENTH, *ELEVENTH, *TWELFTH),
                                                            (27, 8, 3)),
                                                           (FOURTEENTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                         *NINTH, *TENTH, *ELEVENTH, *TWELFTH,
                                                                         *THIRTEENTH), (27, 8, 3)),
                                                           (FIFTEENTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                        *NINTH, *TENTH, *ELEVENTH, *TWELFTH,
                                                                        *THIRTEENTH, *FOURTEENTH), (27, 8, 3)),
                                                           (SIXTEENTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                        *NINTH, *TENTH, *ELEVENTH, *TWELFTH,
                                                                        *THIRTEENTH, *FOURTEENTH, *FIFTEENTH),
                                                            (27, 8, 3)),
                                                           (SEVENTEENTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                          *NINTH, *TENTH, *ELEVENTH, *TWELFTH,
                                                                          *THIRTEENTH, *FOURTEENTH, *FIFTEENTH,
                                                                          *SIXTEENTH), (27, 8, 3)),
                                                           (EIGHTEENTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                         *NINTH, *TENTH, *ELEVENTH, *TWELFTH,
                                                                         *THIRTEENTH, *FOURTEENTH, *FIFTEENTH,
                                                                         *SIXTEENTH, *SEVENTEENTH), (27, 8, 3)),
                                                           (NINETEENTH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                         *NINTH, *TENTH, *ELEVENTH, *TWELFTH,
                                                                         *THIRTEENTH, *FOURTEENTH, *FIFTEENTH,
                                                                         *SIXTEENTH, *SEVENTEENTH, *EIGHTEENTH),
                                                            (27, 8, 3)),
                                                           (TWENTIETH, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                        *NINTH, *TENTH, *ELEVENTH, *TWELFTH,
                                                                        *THIRTEENTH, *FOURTEENTH, *FIFTEENTH,
                                                                        *SIXTEENTH, *SEVENTEENTH, *EIGHTEENTH,
                                                                        *NINETEENTH), (27, 8, 3)),
                                                           (TWENTYFIRST, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                          *NINTH, *TENTH, *ELEVENTH, *TWELFTH,
                                                                          *THIRTEENTH, *FOURTEENTH, *FIFTEENTH,
                                                                          *SIXTEENTH, *SEVENTEENTH, *EIGHTEENTH,
                                                                          *NINETEENTH, *TWENTIETH), (27, 8, 3)),
                                                           (TWENTYSECOND, (*EARLIER, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH,
                                                                           *NINTH, *TENTH, *ELEVENTH, *TWELFTH,
                                                                           *THIRTEENTH, *FOURTEENTH, *FIFTEENTH,
                                                                           *SIXTEENTH, *SEVENTEENTH, *EIGHTEENTH,
                                                                           *NINETEENTH, *TWENTIETH, *TWENTYFIRST),
                                                            (27, 8, 3))])
def test_a_set_of_effects_has_new_ones_of_all_or_of_different_listed_pairs(
        effects: tuple[Effect, ...], earlier: tuple[Effect, ...], kinds: tuple[int, int, int]) -> None:
    own = {effect.name for effect in effects}
    assert len(own) == len(effects) == sum(kinds)
    assert not own & {effect.name for effect in earlier}
    assert len({pair(effect) for effect in effects} & LISTED) == min(len(LISTED), kinds[0])
    assert Counter(map(kind, effects)) == dict(zip(KINDS, kinds, strict=True))


@LISTS
def test_a_list_has_its_own_effects_on_their_benches_in_complete_worlds(
        cases: dict[str, Case], quota: Quota, stated: Stated) -> None:
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
    assert Counter(case.bench for case in FRESH.values()) == {"giant": 48, "heavy": 24, "compact": 24}
    assert Counter(case.bench for case in LATER.values()) == {"light": 48, "heavy": 16, "brisk": 16, "giant": 16}
    assert Counter(case.bench for case in FURTHER.values()) == {"slow": 48, "heavy": 16, "compact": 16, "light": 16}


def test_eight_cases_of_the_list_beyond_are_on_each_drawn_bench() -> None:
    assert Counter(case.bench for case in BEYOND.values()) == {f"drawn{number:02}": 8 for number in range(1, 13)}
    alone = Counter(next(iter(case.effects)) for case in BEYOND.values() if len(case.effects) == 1)
    assert {alone[effect.name] for effect in EIGHTH if listed(effect)} == {2, 3}


@pytest.mark.parametrize(("cases", "first"), [(ABROAD, 13), (AFIELD, 25), (FARTHER, 37), (REMOTE, 49),
                                               (OUTLYING, 61), (DISTANT, 73), (OVERSEAS, 85), (POLAR, 97),
                                               (AUSTRAL, 109), (BOREAL, 121), (ALPINE, 133), (GLACIAL, 145),
                                               (LUNAR, 157), (SOLAR, 169)],
                         ids=["abroad", "afield", "farther", "remote", "outlying", "distant", "overseas", "polar",
                              "austral", "boreal", "alpine", "glacial", "lunar", "solar"])
def test_twelve_cases_of_a_list_are_on_each_bench_drawn_later(cases: dict[str, Case], first: int) -> None:
    benches = [f"drawn{number}" for number in range(first, first + 12)]
    assert Counter(case.bench for case in cases.values()) == dict.fromkeys(benches, 12)
    alone = [(next(iter(case.effects)), case.bench) for case in cases.values() if len(case.effects) == 1]
    assert Counter(bench for name, bench in alone if listed(LAWS[name])) == dict.fromkeys(benches, 7)
    assert set(Counter(name for name, _ in alone if listed(LAWS[name])).values()) == {3, 4}


@LISTS
def test_a_list_has_the_stated_single_effects_and_pairs(
        cases: dict[str, Case], quota: Quota, stated: Stated) -> None:
    alone = [LAWS[next(iter(case.effects))] for case in cases.values() if len(case.effects) == 1]
    assert Counter(map(kind, alone)) == dict(zip(KINDS, stated.alone, strict=True))
    assert {effect for effect in quota.effects if listed(effect)} <= set(alone)
    pairs = [[LAWS[name] for name in case.effects] for case in cases.values() if len(case.effects) == 2]
    assert Counter(first.block == second.block for first, second in pairs) == dict.fromkeys(
        (True, False), stated.pairs)
    assert all(pair(first) != pair(second) for first, second in pairs)
    assert len({frozenset(map(pair, both)) for both in pairs}) == len(pairs) - stated.repeated


@LISTS
def test_strengths_of_a_list_span_the_stated_range(cases: dict[str, Case], quota: Quota, stated: Stated) -> None:
    limits, multiples = read_limits(), []
    for case in cases.values():
        for name, strength in case.effects.items():
            assert strength <= LARGEST_STRENGTH * LAWS[name].typical * 1.01
            if len(case.effects) == 1 and listed(LAWS[name]):
                multiples.append(strength / limits[name, case.bench])
    least, most = stated.least, stated.most
    assert least / 1.5 < min(multiples) < 1.3 * least < 0.87 * most < max(multiples) <= 1.005 * most
    assert np.median(multiples) == pytest.approx(np.sqrt(least * most), rel=0.35)


@pytest.mark.parametrize(("cases", "quota", "seed"), [
    (ABROAD, QUOTA_OF_ABROAD, [53, 89]), (AFIELD, QUOTA_OF_AFIELD, [67, 103]), (FARTHER, QUOTA_OF_FARTHER, [89, 131]),
    (REMOTE, QUOTA_OF_REMOTE, [101, 149]), (OUTLYING, QUOTA_OF_OUTLYING, [103, 151]),
    (DISTANT, QUOTA_OF_DISTANT, [109, 157]), (OVERSEAS, QUOTA_OF_OVERSEAS, [113, 163]),
    (POLAR, QUOTA_OF_POLAR, [127, 173]), (AUSTRAL, QUOTA_OF_AUSTRAL, [131, 179]),
    (BOREAL, QUOTA_OF_BOREAL, [137, 181]), (ALPINE, QUOTA_OF_ALPINE, [139, 191]),
    (GLACIAL, QUOTA_OF_GLACIAL, [149, 193]), (LUNAR, QUOTA_OF_LUNAR, [167, 199]),
    (SOLAR, QUOTA_OF_SOLAR, [173, 211])],
    ids=["abroad", "afield", "farther", "remote", "outlying", "distant", "overseas", "polar", "austral", "boreal",
         "alpine", "glacial", "lunar", "solar"])
def test_a_list_is_drawn_as_it_was(cases: dict[str, Case], quota: Quota, seed: list[int]) -> None:
    drawn = Counter((bench, count, frozenset(strengths))
                    for bench, _, count, strengths in draw(quota, np.random.default_rng(seed)))
    assert Counter((case.bench, case.count, frozenset(case.effects)) for case in cases.values()) == drawn


@pytest.mark.parametrize("cases", [REMOTE, OUTLYING, DISTANT, OVERSEAS, POLAR, AUSTRAL, BOREAL, ALPINE, GLACIAL,
                                   LUNAR, SOLAR],
                         ids=["remote", "outlying", "distant", "overseas", "polar", "austral", "boreal", "alpine",
                              "glacial", "lunar", "solar"])
def test_both_effects_of_a_case_of_the_last_lists_are_of_listed_pairs_and_visible(cases: dict[str, Case]) -> None:
    limits = read_limits()
    pairs = [(LAWS[name], strength / limits[name, case.bench]) for case in cases.values() if len(case.effects) == 2
             for name, strength in case.effects.items()]
    assert all(listed(effect) and multiple > 20 for effect, multiple in pairs)
    assert not all(listed(LAWS[name]) for case in FARTHER.values() if len(case.effects) == 2 for name in case.effects)


def kind(effect: Effect) -> tuple[bool, bool]:
    """Return whether an effect is of a listed pair, and whether it is over a further channel."""
    return listed(effect), effect.abscissa == "oil_temperature"
