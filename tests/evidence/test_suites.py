"""Suites draw what they say, from their seed alone."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from evidence.generator.bench import Bench
from evidence.generator.case import Case, simulate
from evidence.generator.dependences import KNOWN_PAIRS, Dependence
from evidence.generator.draw_bench import draw_bench
from evidence.generator.draw_effect import can_act_in_few_runs, collect_visited, draw_effect
from evidence.generator.files import write_recordings
from evidence.generator.run import Run
from evidence.generator.world import World
from evidence.suites import KNOWN, LARGEST_RATIO, OVER_TEMPERATURE, RUNS, SUITES, UNKNOWN, draw_case

pytestmark = pytest.mark.slow  # what draws the cases of the evidence is no part of the product

SEEDS = (41, 42)


def draw_roughly(patch: pytest.MonkeyPatch) -> None:
    """Measure strengths once, by few runs, with wide tolerances, and without a fit."""
    for name, value in (("suites.MEASURED", 1), ("generator.strength.LANES", 4), ("generator.strength.ROUNDS", 0),
                        ("generator.strength.RELATIVE", 1e-3), ("suites.TRIED", 4),
                        ("suites.simulate", lambda case, relative: simulate(case, 1e-3))):
        patch.setattr(f"evidence.{name}", value)


@cache
def bench_of_seed(seed: int) -> tuple[Bench, Run]:
    return draw_bench([0, seed])


@pytest.fixture(scope="module", params=SUITES)
def cases(request: pytest.FixtureRequest) -> Iterator[tuple[str, list[Case]]]:
    """A suite, and two of its cases, drawn roughly: all suites have the same two benches."""
    with pytest.MonkeyPatch.context() as patch:
        draw_roughly(patch)
        patch.setattr("evidence.suites.draw_bench", lambda key: bench_of_seed(key[1]))
        yield request.param, [draw_case(request.param, seed) for seed in SEEDS]


def test_a_case_has_a_name_that_says_what_it_is(cases: tuple[str, list[Case]]) -> None:
    suite, drawn = cases
    for seed, case in zip(SEEDS, drawn, strict=True):
        first, label, of_seed, *strengths = case.name.split("/")
        assert (first, of_seed) == (suite, f"seed-{seed}")
        assert RUNS[0] <= case.count <= RUNS[1]
        assert strengths == ["+".join(f"{each.strength:.2g}x" for each in case.hidden)] * bool(case.hidden)
        for each in case.hidden:
            assert each.effect.pair[0].replace(" ", "-") in label
    assert drawn[0].bench.text != drawn[1].bench.text


def test_a_suite_hides_what_it_asks_for(cases: tuple[str, list[Case]]) -> None:
    suite, (odd, even) = cases
    known = [[each.effect.pair in KNOWN_PAIRS for each in case.hidden] for case in (odd, even)]
    expected = {"nothing_missing": [[], []], "one_known_effect": [[True], [True]],
                "one_unknown_effect": [[False], [False]], "two_effects": [[True, True], [True, True]],
                "wrong_parameter": [[], []], "faulty_recordings": [[], [True]], "missing_signals": [[], [True]],
                "further_channel": [[True], [False]]}
    assert known == expected[suite]
    if suite == "two_effects":
        same = [case.hidden[0].effect.block == case.hidden[1].effect.block for case in (odd, even)]
        assert same == [True, False]
    if suite == "wrong_parameter":
        (calibrated, factor), (fixed, _) = (*odd.factors.items(), *even.factors.items())
        assert calibrated in odd.bench.uncertain
        assert fixed not in even.bench.uncertain
        assert 1.15 <= max(factor, 1 / factor) <= 1.45
    if suite == "faulty_recordings":
        assert all(case.deviations.bad_runs > 0.05 for case in (odd, even))
    if suite == "missing_signals":
        assert all(1 <= len(case.missing) <= 3 for case in (odd, even))
    if suite == "further_channel":
        assert all(case.deviations.thermometer for case in (odd, even))
        assert even.hidden[0].effect.abscissa == "oil_temperature"


def test_a_case_is_the_same_each_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    draw_roughly(monkeypatch)
    for name in ("first.h5", "second.h5"):
        case = draw_case("faulty_recordings", SEEDS[1])
        write_recordings(tmp_path / name, case, simulate(case, 1e-3))
    assert (tmp_path / "first.h5").read_bytes() == (tmp_path / "second.h5").read_bytes()


@pytest.fixture(scope="module")
def nominal() -> Run:
    return bench_of_seed(SEEDS[0])[1]


@pytest.mark.parametrize("dependence", [*KNOWN, *UNKNOWN[::9], *OVER_TEMPERATURE[::5]],
                         ids=lambda dependence: f"{dependence.quantity}-{dependence.abscissa}")
def test_a_drawn_law_is_neutral_without_amplitude_and_small_at_the_typical_one(
        dependence: Dependence, nominal: Run) -> None:
    drawn = draw_effect(dependence, nominal, np.random.default_rng(7))
    effect, values = drawn.effect, collect_visited(dependence.quantity, dependence.abscissa, nominal) if (
        dependence.law not in ("plays", "sensor lag")) else np.zeros(2)
    x = np.linspace(values.min(), values.max(), 500)
    neutral = 1.0 if effect.kind == "ratio" else 0.0
    np.testing.assert_allclose(effect.law(0.0, x), neutral, atol=1e-12)
    change = effect.law(drawn.typical, x)
    assert np.all(np.isfinite(change))
    if effect.kind == "ratio":
        assert 1 / LARGEST_RATIO < change.min() <= change.max() < LARGEST_RATIO
    if effect.response is None and effect.plays is None:
        assert np.ptp(change) > 0 or effect.quantity in ("friction_lag", "converter_lag", "shaft_compliance")
    assert drawn.typical > 0


def test_effects_that_no_run_can_lack_act_in_all(nominal: Run) -> None:
    few = {dependence.quantity for dependence in KNOWN if can_act_in_few_runs(
        draw_effect(dependence, nominal, np.random.default_rng(1)).effect)}
    assert {"friction_coefficient", "chamber_pressure", "load_torque"} <= few
    assert not few & {"pressure_gain", "clearance_sequence", "friction_lag", "shaft_compliance", "valve_plays"}


def test_forms_of_all_trends_and_many_families_are_drawn(nominal: Run) -> None:
    random = np.random.default_rng(3)
    effects = [draw_effect(KNOWN[random.integers(len(KNOWN))], nominal, random).effect for _ in range(200)]
    assert {effect.trend for effect in effects} == {"falling", "rising", "neither"}
    assert len({effect.form for effect in effects}) > 30


def test_a_world_of_a_case_is_complete() -> None:
    case = draw_case("nothing_missing", 41)
    assert all(getattr(case.deviations, name) != getattr(World(), name) for name in (
        "scatter", "noise", "memory", "time_noise", "converter", "conditions", "sag", "clocks", "bad_runs"))
