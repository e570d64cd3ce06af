"""The unseen effects of the simulated test bench, and its lists of cases, are as its README states."""

import csv
import json
from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hidden import EFFECTS, INGREDIENTS, LAWS, UNSEEN, Case, World, simulate
from hidden.__main__ import main
from hidden.cases import LISTS
from hidden.effect import Effect
from hidden.forms import BENCHES, FORMS, ON_DRAWN
from hidden.limits import compute, used
from hidden.limits import read as read_limits
from hidden.nominal import BRISK
from hidden.pairs import DEPENDS_ON, LISTED, QUANTITY, listed, pair
from hidden.plan import LARGEST_STRENGTH
from hidden.plan_drawn import PLANS
from hidden.temptations import TEMPTATIONS

from slipstick.recordings import Recordings

DATA = Path(__file__).parent / "hidden" / "data"
DEPENDENCES = {*DEPENDS_ON.values(), "past current", "lag", "offset", "gain"}


def test_number_of_unseen_effects() -> None:
    assert len(UNSEEN) == 75
    assert not {effect.name for effect in UNSEEN} & set(EFFECTS)
    assert sum(not listed(effect) for effect in UNSEEN) == 24


def test_every_listed_pair_has_an_unseen_form() -> None:
    assert {pair(effect) for effect in UNSEEN} >= LISTED - {("piston rate", "pressure")}


@pytest.mark.parametrize("effect", LAWS.values(), ids=LAWS)
def test_an_effect_has_a_pair_of_the_vocabulary_and_a_finite_law(effect: Effect) -> None:
    quantity, depends_on = pair(effect)
    assert quantity in QUANTITY.values()
    assert depends_on in DEPENDENCES
    if effect.pair and effect.quantity.split("_sensor")[0] not in ("pressure", "input_speed", "output_speed",
                                                                    "output_torque"):
        assert pair(replace(effect, pair=None)) == effect.pair
    abscissa = np.geomspace(0.1, 200, 40)
    if effect.abscissa in ("pressure", "free_piston_rate", "driving_pressure", "current_excess", "energy"):
        abscissa = np.concatenate([[-5.0, -0.01, 0.0], abscissa])
    assert np.all(np.isfinite(effect.law(effect.typical, abscissa)))
    np.testing.assert_array_equal(effect.law(0.0, abscissa), 1 if effect.kind == "ratio" else 0)


@cache
def alone(bench: str) -> dict[str, np.ndarray]:
    return few(bench)


def few(bench: str, **effects: float) -> dict[str, np.ndarray]:
    return simulate(Case(effects, bench=bench, count=3, shift="none", scatter=0), relative=1e-4).readings


OF_EACH_QUANTITY: dict[str, Effect] = {}
for effects in FORMS.values():
    OF_EACH_QUANTITY |= {effect.quantity: effect for effect in effects if effect.quantity not in OF_EACH_QUANTITY}
ITS_BENCHES = {name: on for benches in BENCHES.values() for name, on in benches.items()}


@pytest.mark.parametrize(("place", "effect"), [
    pytest.param(place, effect, id=quantity, marks=[pytest.mark.slow] * (place % 4 > 0))
    for place, (quantity, effect) in enumerate(OF_EACH_QUANTITY.items())])
def test_an_unseen_effect_is_visible(place: int, effect: Effect) -> None:
    on = ITS_BENCHES[effect.name]
    bench = on[place % len(on[:2])]
    changed = few(bench, **{effect.name: effect.typical})
    rms = {name: np.sqrt(np.mean((changed[name] - signal) ** 2)) / np.ptp(signal)
           for name, signal in alone(bench).items()}
    assert 3e-3 < max(rms.values()) < 0.15
    sensor = effect.quantity.split("_sensor")[0]
    assert sensor == effect.quantity or [name for name in rms if rms[name] > 1e-9] == [sensor]


def test_a_limit_is_reproducible_and_stored_for_every_effect() -> None:
    limits = read_limits()
    assert set(limits) == set(used())
    drawn = {name for which in ON_DRAWN for name in BENCHES[which]}
    own = {name for which in ("fresh", "later", "further") for name in BENCHES[which]}
    for (name, _), limit in limits.items():
        least, most = (0.5, 100) if name in drawn else (1, 100) if name in own else (1.2, 50)
        assert least < LAWS[name].typical / limit < most
    assert compute("torque_zero_drifts", "heavy") == pytest.approx(limits["torque_zero_drifts", "heavy"], rel=0.05)


def is_null(case: Case) -> bool:
    return not case.effects


def test_the_development_list_is_as_stated() -> None:
    cases = list(LISTS["development"].values())
    assert len(cases) == 80
    assert sum(map(is_null, cases)) == 15
    assert {name for case in cases for name in case.effects} == set(EFFECTS)
    assert sum(len(case.effects) == 2 for case in cases) == 23
    assert 0.4 < np.mean([case.drawn_world.scatter is not None for case in cases]) < 0.6
    for case in cases:
        for name, strength in case.effects.items():
            assert 0.2 < strength / LAWS[name].typical < 10.1


def test_the_final_list_has_only_unseen_effects() -> None:
    cases = list(LISTS["final"].values())
    unseen = {effect.name for effect in UNSEEN}
    assert {name for case in cases for name in case.effects} == unseen
    assert sum(map(is_null, cases)) == 32
    assert sum(len(case.effects) == 2 for case in cases) == 22
    assert sum(len(case.effects) == 1 and not listed(LAWS[next(iter(case.effects))]) for case in cases) >= 25
    assert 150 <= len(cases) <= 170
    assert all(case.drawn_world.scatter and case.drawn_world.sag for case in cases if case.effects)
    assert Counter(case.bench for case in cases)["compact"] >= 70


def test_the_unseen_list_has_only_effects_of_its_own() -> None:
    cases, own = list(LISTS["unseen"].values()), {effect.name for effect in FORMS["unseen"]}
    assert not own & {effect.name for effect in UNSEEN} | own & set(EFFECTS)
    assert {name for case in cases for name in case.effects} <= own
    assert len(cases) == 48
    assert sum(map(is_null, cases)) == 10
    alone = [LAWS[next(iter(case.effects))] for case in cases if len(case.effects) == 1]
    assert Counter((listed(effect), effect.abscissa == "oil_temperature") for effect in alone) == {
        (True, False): 24, (False, False): 6, (False, True): 2}
    pairs = [[LAWS[name] for name in case.effects] for case in cases if len(case.effects) == 2]
    assert Counter(first.block == second.block for first, second in pairs) == {True: 3, False: 3}
    assert all(pair(first) != pair(second) for first, second in pairs)
    assert Counter(case.bench for case in cases) == {"heavy": 24, "compact": 24}
    assert all(set(ingredients(case.drawn_world)) == set(INGREDIENTS) for case in cases if case.effects)
    assert Counter(case.count == 27 for case in cases)[True] == 4
    assert all(54 <= case.count <= 108 for case in cases if case.count != 27)


@pytest.mark.parametrize("which", list(LISTS)[2:])
def test_nulls_of_a_list_tempt_in_every_way(which: str) -> None:
    with (DATA / f"{which}.csv").open() as file:
        texts = [row["world"].split("+") for row in csv.DictReader(file) if not row["effects"]]
    times = 1 if which in ("unseen", "elsewhere") else 2
    more = {"beyond": ["batches"], **{which: list(plan.more) for which, plan in PLANS.items()}}.get(which, [])
    assert sorted(name for text in texts for name in text if name in TEMPTATIONS) == sorted(
        [*TEMPTATIONS] * times + more)


def test_strengths_of_the_unseen_list_span_the_stated_range() -> None:
    limits = read_limits()
    multiples = []
    for case in LISTS["unseen"].values():
        for name, strength in case.effects.items():
            assert strength <= LARGEST_STRENGTH * LAWS[name].typical * 1.01
            if len(case.effects) == 1 and listed(LAWS[name]):
                multiples.append(strength / limits[name, case.bench])
    assert 0.4 < min(multiples) < max(multiples) <= 30.1
    assert np.mean(np.less(multiples, 4)) == pytest.approx(0.5, abs=0.15)


def test_the_list_elsewhere_has_only_effects_and_a_bench_of_its_own() -> None:
    cases, own = list(LISTS["elsewhere"].values()), {effect.name for effect in FORMS["elsewhere"]}
    assert len(own) == len(FORMS["elsewhere"])
    assert not own & {effect.name for effect in (*UNSEEN, *FORMS["unseen"])} | own & set(EFFECTS)
    assert sum(map(listed, FORMS["elsewhere"])) == 34
    assert {name for case in cases for name in case.effects} <= own
    assert {case.bench for case in cases} == {"brisk"}
    assert {case.bench for which in ("development", "final", "unseen") for case in LISTS[which].values()} == {
        "heavy", "compact"}
    assert len(cases) == 48
    assert sum(map(is_null, cases)) == 12
    alone = [LAWS[next(iter(case.effects))] for case in cases if len(case.effects) == 1]
    assert len(set(alone)) == len(alone)
    assert Counter((listed(effect), effect.abscissa == "oil_temperature") for effect in alone) == {
        (True, False): 26, (False, False): 5, (False, True): 2}
    pairs = [[LAWS[name] for name in case.effects] for case in cases if len(case.effects) == 2]
    assert Counter(first.block == second.block for first, second in pairs) == {True: 2, False: 1}
    assert all(pair(first) != pair(second) for first, second in pairs)
    assert all(set(ingredients(case.drawn_world)) == set(INGREDIENTS) for case in cases)
    assert Counter(case.count for case in cases) == {27: 6, 54: 32, len(BRISK.profile): 10}


def test_strengths_of_the_list_elsewhere_span_the_stated_range() -> None:
    limits = read_limits()
    multiples = []
    for case in LISTS["elsewhere"].values():
        for name, strength in case.effects.items():
            assert strength <= LARGEST_STRENGTH * LAWS[name].typical * 1.01
            if len(case.effects) == 1 and listed(LAWS[name]):
                multiples.append(strength / limits[name, "brisk"])
    assert 0.4 < min(multiples) < max(multiples) <= 30.2
    assert np.mean(np.less(multiples, 4)) == pytest.approx(0.5, abs=0.15)


def test_strengths_of_the_final_list_span_the_stated_range() -> None:
    limits = read_limits()
    multiples = [strength / limits[name, case.bench]
                 for case in LISTS["final"].values() if len(case.effects) == 1
                 for name, strength in case.effects.items()]
    assert max(multiples) <= 30.1
    assert np.mean(np.less(multiples, 0.4)) < 0.05
    assert np.mean(np.less(multiples, 4)) == pytest.approx(0.5, abs=0.15)
    for case in LISTS["final"].values():
        for name, strength in case.effects.items():
            assert strength <= LARGEST_STRENGTH * LAWS[name].typical * 1.01


@pytest.mark.parametrize("which", ["development", "final"])
def test_nulls_have_each_ingredient_alone_and_none_and_all(which: str) -> None:
    present = [frozenset(ingredients(case.drawn_world)) for case in LISTS[which].values() if is_null(case)]
    assert {frozenset(), frozenset(INGREDIENTS), *(frozenset([name]) for name in INGREDIENTS)} == set(present)


def ingredients(world: World) -> list[str]:
    return [name for name in INGREDIENTS if getattr(world, name)]


def test_seeds_and_files_of_the_lists_differ() -> None:
    seeds = [case.seed for cases in LISTS.values() for case in cases.values()]
    assert len(set(seeds)) == len(seeds)
    assert len({identity for cases in LISTS.values() for identity in cases}) == len(seeds)


def test_a_list_is_written_without_its_truth(tmp_path: Path) -> None:
    cases = LISTS["development"]
    name = next(name for name, case in cases.items() if case.bench == "compact" and len(case.effects) == 1)
    main([str(tmp_path / "files"), "development", name, "--truth", str(tmp_path / "truth.json")])
    file = tmp_path / "files" / f"{name}.h5"
    assert list((tmp_path / "files").iterdir()) == [file]
    assert len(Recordings.open(file).measured_time) == cases[name].count
    (hidden,) = json.loads((tmp_path / "truth.json").read_text())[name]["hidden"]
    ((effect, strength),) = cases[name].effects.items()
    assert (hidden["name"], hidden["strength"]) == (effect, strength)
    assert tuple(hidden["pair"]) == pair(LAWS[effect])
    written = file.stat().st_mtime_ns
    main([str(tmp_path / "files"), "development", name, "--truth", str(tmp_path / "truth.json")])
    assert file.stat().st_mtime_ns == written
