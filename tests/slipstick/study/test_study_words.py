"""What findings are called, and the answer in one sentence."""

import pytest

from slipstick.study.result import (
    Candidate,
    Confirmation,
    CountedFindings,
    Explanation,
    FindingResult,
    Remainder,
    Worth,
)
from slipstick.study.words import NOTHING, sentence, title

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


def test_a_tie_names_all_and_an_unlisted_finding_says_so() -> None:
    tied = finding("tie", rivals=(Candidate(None, "load torque", "time", 48.0, 0.7),))
    assert "one of 2 that these recordings do not tell apart: quadratic load drag, load torque that depends on the " \
           "time" in sentence([tied], [])
    unlisted = finding("unlisted", None, ("load torque", "time"))
    assert "which no effect of the catalogue explains" in sentence([unlisted], [])


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
