"""What findings are called, and the answer in one sentence."""

import pytest

from slipstick.study.result import Candidate, Confirmation, CountedFindings, FindingResult, Remainder
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
