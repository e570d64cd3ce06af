"""Verdicts, rates and comparisons of answers whose truth is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from evidence.answer import Answer, LawOfPair, NamedPair
from evidence.generator.truth import HiddenEffect, Truth
from evidence.judge import judge
from evidence.laws import compare
from evidence.rates import Entry, bounds, compare_methods, rate
from evidence.tables import print_comparison, print_rates, read_rates, write_answers, write_rates

DRAG = HiddenEffect(("load torque", "output speed"), True, "output speed", "spline", "rising", 1.0, 3.0, "load_torque",
                    "output_speed", "difference", None, [0.0, 5.0, 10.0], [0.0, 2.0, 8.0], [0.3, 0.4, 0.3])
PARAMETERS = {"gr": 3.0, "b2": 2e-3, "c2": 4.0, "d2": 8.0}
CASE = "one_known_effect/load-torque-over-output-speed/seed-1/3x"
RIGHT = NamedPair(("load torque", "output speed"), effect="quadratic_load_drag", nats=100.0, confidence=0.95)
WRONG = NamedPair(("input torque", "time"), nats=5.0, confidence=0.3, reported=False)


def truth_of(*hidden: HiddenEffect, case: str = CASE) -> Truth:
    return Truth(case, 40, hidden, (), {}, (), PARAMETERS)


def entry_of(*findings: NamedPair, hidden: tuple[HiddenEffect, ...] = (DRAG,), case: str = CASE,
             unexplained: tuple[str, ...] = ()) -> Entry:
    return Entry(truth_of(*hidden, case=case), Answer(case, findings, unexplained))


def test_a_right_name_is_first_and_a_smaller_wrong_one_is_too_many_until_it_is_filtered() -> None:
    entry = entry_of(RIGHT, WRONG)
    before, after = entry.verdict("all"), entry.verdict("reported")
    assert (before.right_first, before.effects_named, before.too_many, before.sure) == (True, 1, 1, True)
    assert (after.right_first, after.effects_named, after.too_many) == (True, 1, 0)
    assert entry.answer.reported.unexplained == ("input",)
    assert not entry_of(WRONG).verdict("all").right_first


def test_a_tie_is_in_the_answer_and_not_first() -> None:
    tied = replace(WRONG, rivals=(RIGHT.pair,), reported=True)
    verdict = entry_of(tied).verdict("all")
    assert (verdict.right_first, verdict.effects_named, verdict.too_many) == (False, 1, 0)


def test_a_wrong_name_that_is_sure_is_told() -> None:
    assert entry_of(replace(WRONG, confidence=0.9)).verdict("all").wrong_and_sure
    assert not entry_of(RIGHT, WRONG).verdict("all").wrong_and_sure


@pytest.mark.parametrize(("hidden", "said"), [
    (("friction coefficient", "lag"), ("contact pressure", "lag")),
    (("friction coefficient", "lag"), ("friction lag", "slip")),
    (("converter torque", "lag"), ("converter lag", "time")),
    (("load torque", "output speed"), ("brake torque", "output speed")),
    (("piston rate", "pressure"), ("clearance", "pressure")),
])
def test_pairs_that_are_the_same_effect_are_right(hidden: tuple[str, str], said: tuple[str, str]) -> None:
    truth = truth_of(replace(DRAG, pair=hidden))
    assert judge(Answer(CASE, (NamedPair(said),)), truth).right_first
    assert not judge(Answer(CASE, (NamedPair((said[0], "nothing")),)), truth_of(DRAG)).right_first


def test_an_offset_that_drifts_is_also_an_error_over_the_run_order() -> None:
    offset = replace(DRAG, pair=("pressure sensor", "offset"), quantity="pressure_sensor", abscissa="sequence")
    assert judge(Answer(CASE, (NamedPair(("pressure sensor", "run order")),)), truth_of(offset)).right_first
    assert not judge(Answer(CASE, (NamedPair(("pressure sensor", "time")),)), truth_of(offset)).right_first


def test_a_block_is_right_by_a_finding_or_a_misfit_there() -> None:
    assert entry_of(unexplained=("load",)).verdict("all").right_block
    assert not entry_of(unexplained=("valve",)).verdict("all").right_block
    friction = replace(DRAG, pair=("friction coefficient", "current"), is_known=False)
    assert entry_of(hidden=(friction,), unexplained=("contact",)).verdict("all").right_block
    assert entry_of(RIGHT, hidden=(friction,)).verdict("all").named_unknown


def test_rates_count_visible_effects_and_weak_ones_apart() -> None:
    weak = replace(DRAG, strength=0.5)
    entries = [entry_of(RIGHT), entry_of(), entry_of(WRONG, hidden=(weak,)),
               entry_of(RIGHT, hidden=(replace(DRAG, share=0.1),)),
               *(entry_of(hidden=(), case=f"nothing_missing/plain/seed-{seed}") for seed in range(3)),
               entry_of(RIGHT, hidden=(), case="nothing_missing/plain/seed-7")]
    rates = {(each.suite, each.what, each.stage): (each.hits, each.of) for each in rate(entries)}
    assert rates["one_known_effect", "visible: right first", "all"] == (1, 2)
    assert rates["one_known_effect", "visible, in a tenth of the runs: right first", "all"] == (1, 1)
    assert rates["one_known_effect", "below the noise: right first", "all"] == (0, 1)
    assert rates["nothing_missing", "something said to be missing", "all"] == (1, 4)
    assert rates["nothing_missing", "a wrong name that is sure", "all"] == (1, 4)
    assert rates["all", "findings with a confidence of 0.9 or more: right", "reported"] == (2, 3)


def test_bounds_are_those_of_clopper_and_pearson() -> None:
    assert bounds(0, 20) == pytest.approx((0, 0.1684), abs=1e-4)
    assert bounds(7, 10) == pytest.approx((0.3475, 0.9333), abs=1e-4)
    assert bounds(3, 3)[1] == 1


def test_methods_are_compared_on_the_same_cases_only() -> None:
    cases = [f"one_known_effect/x/seed-{seed}/3x" for seed in range(12)]
    before = [entry_of(RIGHT, case=case) for case in cases]
    after = [entry_of(*([RIGHT] if number < 5 else []), case=case) for number, case in enumerate(cases[:10])]
    comparisons = {each.what: each for each in compare_methods(before, after)}
    first = comparisons["right first"]
    assert (first.cases, first.before, first.after, first.gained, first.lost, first.stands) == (10, 10, 5, 0, 5, False)
    assert comparisons["no name too many"].stands
    assert "right first" in print_comparison(list(comparisons.values()))
    few = compare_methods(before, after[:7])[0]
    assert (few.lost, few.stands) == (2, True)


def test_one_false_alarm_more_may_be_chance_and_two_may_not() -> None:
    cases = [f"nothing_missing/plain/seed-{seed}" for seed in range(6)]
    silent = [entry_of(hidden=(), case=case) for case in cases]
    for alarms, stands in ((1, True), (2, False)):
        after = [entry_of(*([WRONG] if number < alarms else []), hidden=(), case=case)
                 for number, case in enumerate(cases)]
        assert compare_methods(silent, after)[-1].stands is stands


def test_a_law_is_compared_over_the_slip_before_the_gear_and_with_the_sign_of_an_input_torque() -> None:
    grid = np.linspace(0, 10, 5)
    visits = [0.2] * 5
    friction = replace(DRAG, quantity="friction_coefficient", abscissa="slip", base=1.0, grid=grid.tolist(),
                       change=(0.1 * grid).tolist(), visits=visits, pair=("friction coefficient", "slip"))
    drag = replace(friction, quantity="input_drag", abscissa="input_speed", base=None,
                   pair=("input torque", "input speed"))
    errors = [0.01] * 5
    law = LawOfPair(friction.pair, (3 * grid).tolist(), (0.1 * grid).tolist(), errors, True, "nothing")
    torque = LawOfPair(drag.pair, grid.tolist(), (-0.1 * grid).tolist(), errors, False, "nothing")
    for measured, hidden in ((law, friction), (torque, drag)):
        difference = compare(measured, hidden, truth_of())
        assert difference is not None
        assert (difference.share, difference.held) == (pytest.approx(0, abs=1e-12), pytest.approx(1))
    twice = compare(replace(torque, change=(-0.2 * grid).tolist()), drag, truth_of())
    assert twice is not None
    assert (twice.share, twice.held) == (pytest.approx(1), pytest.approx(0.2))


def test_a_force_on_the_piston_is_compared_as_the_rate_that_it_causes() -> None:
    grid = np.linspace(0, 2e-3, 5)
    pair, visits = ("piston rate", "piston position"), [0.2] * 5
    force = replace(DRAG, quantity="net_pressure", abscissa="piston", grid=grid.tolist(),
                    change=(-100 * grid).tolist(), visits=visits, pair=pair)
    spring = replace(force, quantity="spring_rate", kind="ratio", base=8.0, change=[1.5] * 5)
    for hidden, rate_of in ((force, -100 * grid * 2e-3 / 4), (spring, -0.5 * 8.0 * grid / 4)):
        law = LawOfPair(pair, grid.tolist(), rate_of.tolist(), [1e-5] * 5, False, "nothing")
        difference = compare(law, hidden, truth_of())
        assert difference is not None
        assert difference.share == pytest.approx(0, abs=1e-12)


def test_tables_can_be_read_again(tmp_path: Path) -> None:
    entries = [entry_of(RIGHT, WRONG), entry_of(hidden=(), case="nothing_missing/plain/seed-2")]
    rates = rate(entries)
    write_rates(tmp_path / "rates.csv", "naming abc", rates)
    assert read_rates(tmp_path / "rates.csv") == rates
    write_answers(tmp_path / "answers.csv", "naming abc", entries)
    header, nothing, single = (tmp_path / "answers.csv").read_text().splitlines()
    assert nothing.startswith("naming abc,nothing_missing/plain/seed-2,40,0")
    assert "load torque over output speed (0.95),input torque over time (0.30),input" in single
    assert len(header.split(",")) == len(nothing.split(","))
    assert "1 of    1" in print_rates(rates)
