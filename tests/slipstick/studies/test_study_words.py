"""What findings are called, the formula of an effect beside a law, the answer in a sentence, and progress in words."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.clutch.effects import Shape, find
from slipstick.naming.asked import Asked, steps
from slipstick.naming.measured import LawPoints
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.studies.formula import formula
from slipstick.studies.progress import StudyProgress, StudySteps
from slipstick.studies.result import (
    Candidate,
    Confirmation,
    CountedFindings,
    Explanation,
    FindingResult,
    Remainder,
    Worth,
)
from slipstick.studies.words import NOTHING, sentence, title

CONFIRMED = Confirmation("formula", [], True)


def finding(kind: str = "effect", effect: str | None = "quadratic_load_drag",
            pair: tuple[str, str] = ("load torque", "output speed"), rivals: tuple[Candidate, ...] = (),
            confirmation: Confirmation = CONFIRMED) -> FindingResult:
    return FindingResult(kind, effect, title(pair, effect), *pair, ["load"], 50.0, 6.0,  # type: ignore[arg-type]
                         list(rivals), None, confirmation, None, None, None, [])


@pytest.mark.parametrize(("pair", "effect", "words"), [
    (("load torque", "output speed"), "quadratic_load_drag", "Quadratic load drag"),
    (("load torque", "time"), None, "Load torque that depends on the time"),
    (("output torque sensor", "lag"), None, "Lag of the output torque sensor"),
    (("input speed sensor", "gain"), None, "Gain error of the input speed sensor"),
    (("valve current", "past current"), None, "Valve current that depends on the past of the current")])
def test_a_finding_has_a_title(pair: tuple[str, str], effect: str | None, words: str) -> None:
    assert title(pair, effect) == words


def test_nothing_is_an_answer() -> None:
    assert sentence([], []) == NOTHING


def test_what_no_law_explains_is_said_alone_and_beside_findings() -> None:
    alone = sentence([], ["load"])
    assert alone == "Something is missing in the block “torque → output speed”, and no law that was tried explains it"
    both = sentence([finding()], ["valve"])
    assert both.startswith("Missing: quadratic load drag. Something more is missing in the block “current → pressure”")


def test_engagements_that_stand_out_are_said_where_nothing_was_found() -> None:
    assert sentence([], [], {"load": [17]}) == (
        "Something is missing in the block “torque → output speed”, or engagement 17 is bad: it is far worse there "
        "than the others")
    several = sentence([], [], {"load": [17, 4], "valve": [3, 17]})
    assert "or engagements 3, 4 and 17 are bad: they are far worse there" in several
    assert sentence([finding()], [], {"load": [17]}) == "Missing: quadratic load drag"


def test_a_tie_names_the_other_or_counts_others_and_an_unlisted_finding_says_so() -> None:
    tied = finding("tie", rivals=(Candidate(None, "load torque", "time", 48.0, 0.7),
                                  Candidate("seal_friction", "load torque", "output speed", 48.0, 0.0)))
    assert sentence([tied], []) == "Missing: quadratic load drag (or 2 others)"
    unlisted = finding("unlisted", None, ("load torque", "time"))
    assert sentence([tied, unlisted], []) == (
        "Missing: quadratic load drag (or seal friction of the piston) and load torque that depends on the time (which "
        "no effect of the catalogue explains)")


def test_what_the_simulation_does_not_confirm_is_said() -> None:
    doubtful = finding(confirmation=Confirmation("formula", [], False))
    assert "not confirmed by the simulation" in sentence([doubtful], [])
    assert "not confirmed" not in sentence([finding(confirmation=Confirmation("no", [], None))], [])


def test_what_a_finding_leaves_is_no_second_finding() -> None:
    left = Remainder(None, "Load torque that depends on the time", "load torque", "time", ["load"], 30.0, 0.2,
                     CountedFindings(0.0, 0.4, 9, 44))
    said = sentence([finding()], [], remainders=[left])
    assert said == ("Missing: quadratic load drag. What is left in the block “torque → output speed” resembles this: "
                    "load torque that depends on the time. More likely it is what the laws of the findings do not "
                    "follow")


def explanation(effect: str, tied: bool = False, sufficient: bool = True) -> Explanation:
    return Explanation(effect, 50.0, 6.0, tied, {"shifting_time": 1.0}, sufficient, Worth(3.0, 9.0, {}))


def test_without_a_tested_block_it_says_what_the_simulation_tells() -> None:
    signals = ["pressure", "input_speed", "output_speed"]
    assert sentence([], [], any_tested=False, missing=signals) == (
        "The parameters of the bench explain these recordings. No block was tested: the recordings have no pressure, "
        "input speed and output speed")
    absent = sentence([], [], any_tested=False, missing=signals, misfits=["shifting_time"])
    assert absent.startswith("Something is missing that shows in the shifting time. No block was tested")


def test_effects_that_would_explain_a_misfit_are_said_as_far_as_they_are_told_apart() -> None:
    def said(*explanations: Explanation) -> str:
        return sentence([], [], missing=["pressure"], misfits=["output_torque"], explanations=explanations)

    first = explanation("stribeck_friction")
    assert said(first, explanation("seal_friction")) == (
        "Something is missing that shows in the output torque, but in no block that could be tested. Of the effects in "
        "the catalogue, slip-speed-dependent friction would explain it. Not every block was tested: the recordings "
        "have no pressure")
    assert "would explain it, and is not told apart from seal friction of the piston." in said(
        first, explanation("seal_friction", tied=True)) + "."
    assert "would explain most, but not all of it" in said(explanation("stribeck_friction", sufficient=False))
    beside = sentence([finding()], [], missing=["pressure"], misfits=["output_torque"], explanations=[first])
    assert beside.startswith("Missing: quadratic load drag. Something is missing that shows in the output torque")


# The formula of an effect beside a measured law.


X = np.linspace(0.0, 100.0, 6)


def law(pair: tuple[str, str], change: np.ndarray, relative: bool = False, up_to: str = "nothing") -> LawPoints:
    return LawPoints(pair, X, "rad/s", change, "N m", relative, np.eye(len(X)), up_to)  # type: ignore[arg-type]


def test_the_formula_of_a_sensor_is_not_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    def creep(values: np.ndarray, times: np.ndarray, c: tuple[float, ...]) -> np.ndarray:
        return np.asarray(values + c[0] * times)
    effect = replace(find("output_torque_sensor_offset"), depends_on="time", formula=creep, shape=Shape())
    monkeypatch.setattr("slipstick.studies.formula.find", lambda name: effect)
    assert formula(effect.name, [5.0], law(("output torque sensor", "time"), 5.0 * X)) is None


def test_a_drag_is_the_square_of_the_speed() -> None:
    found = formula("quadratic_load_drag", [0.03], law(("load torque", "output speed"), 0.03 * X**2))
    np.testing.assert_allclose(found, 0.03 * X**2)  # type: ignore[arg-type]


def test_a_law_known_up_to_a_constant_is_compared_after_it_is_fitted() -> None:
    measured = law(("load torque", "output speed"), 0.03 * X**2 - 7, up_to="constant")
    found = formula("quadratic_load_drag", [0.03], measured)
    np.testing.assert_allclose(found, measured.change, atol=1e-12)  # type: ignore[arg-type]


def test_a_share_of_the_mean_is_compared_after_a_factor_is_fitted() -> None:
    exact = formula("stribeck_friction", [0.2, 20.0], law(("friction coefficient", "slip"), 0 * X, True))
    assert exact is not None
    measured = law(("friction coefficient", "slip"), (1 + exact) / 1.07 - 1, True, "constant")
    found = formula("stribeck_friction", [0.2, 20.0], measured)
    np.testing.assert_allclose(found, measured.change, atol=1e-12)  # type: ignore[arg-type]


def test_a_seal_friction_takes_the_drag_off_a_rate_in_both_directions() -> None:
    rates = np.array([-30.0, 0.0, 30.0])
    measured = LawPoints(("piston rate", "direction"), rates, "m/s", 0 * rates, "m/s", False, np.eye(3))
    np.testing.assert_allclose(formula("seal_friction", [0.01], measured), [0.01, 0.0, -0.01], rtol=1e-6)  # type: ignore[arg-type]


@pytest.mark.parametrize(("name", "pair"), [
    ("friction_buildup_lag", ("contact pressure", "lag")), ("entrained_air", ("piston rate", "pressure"))])
def test_memories_and_other_pairs_have_no_formula_over_the_points(name: str, pair: tuple[str, str]) -> None:
    assert formula(name, [0.1, 0.1], law(pair, X)) is None


# The progress of a study: steps by the signals, a share that never falls, and words for what is tried.


ALL = tuple(SIGNAL_UNITS)


def reports(signals: tuple[str, ...], *asked: Asked) -> list[StudyProgress]:
    found: list[StudyProgress] = []
    its = StudySteps(signals, found.append)
    for one in asked:
        its.report_naming(one)
    its.report_confirming("fit", "Fitting")
    its.report_confirming("predict", "Predicting")
    return found


@pytest.mark.parametrize(("can", "expected"), [
    (("valve",), ("engagements", "valve")),
    (("load",), ("engagements", "load", "laws")),
    (("valve", "contact", "clutch", "load", "input", "lock"),
     ("engagements", "valve", "onset", "load", "input", "lock", "contact", "laws", "clutch"))])
def test_the_steps_are_those_of_the_blocks_that_can_be_asked(can: tuple[str, ...], expected: tuple[str, ...]) -> None:
    assert steps(can) == expected


def test_the_share_counts_complete_steps_and_does_not_fall_when_blocks_are_fitted_again() -> None:
    asked = [Asked("engagements"), Asked("valve", ("valve",)), Asked("contact", ("contact",)),
             Asked("valve", ("valve",)), Asked("laws", ("load", "contact"), compares=True)]
    found = reports(ALL, *asked)
    assert {one.steps for one in found} == {12}
    assert [one.step for one in found] == [1, 2, 7, 2, 8, 10, 12]
    assert [round(one.done * 12) for one in found] == [0, 1, 6, 6, 7, 9, 11]
    assert [one.stage for one in found] == ["name"] * 5 + ["confirm"] * 2


def test_fewer_signals_have_fewer_steps() -> None:
    found = reports(("pressure",), Asked("engagements"), Asked("valve", ("valve",)))
    assert [(one.step, one.steps) for one in found] == [(1, 5), (2, 5), (3, 5), (5, 5)]


def test_the_words_name_the_blocks_and_the_law_that_is_tried() -> None:
    found = reports(ALL, Asked("laws", ("load", "contact"), ("friction coefficient", "slip")),
                    Asked("laws", ("load", "input", "contact"), compares=True), Asked("onset", ("clutch",)),
                    Asked("valve", ("valve",), ("line pressure", "lag")))
    assert [one.doing for one in found[:4]] == [
        "Blocks “torque → output speed” and “pressure, slip → torque in full contact”: trying “friction coefficient "
        "that depends on the slip”",
        "Blocks “torque → output speed”, “torque → input speed” and “pressure, slip → torque in full contact”: "
        "comparing what each law would explain",
        "Block “pressure, speeds → torque while the plates close”: fitting the parameters up to full contact",
        "Block “current → pressure”: trying “lag of the line pressure”"]
