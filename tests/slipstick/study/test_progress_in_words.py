"""The progress of a study: steps by the signals, a share that never falls, and words for what is tried."""

import pytest

from slipstick.naming.asked import Asked, steps
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.study.progress import StudyProgress, StudySteps

ALL = tuple(SIGNAL_UNITS)


def reports(signals: tuple[str, ...], *asked: Asked) -> list[StudyProgress]:
    found: list[StudyProgress] = []
    its = StudySteps(signals, found.append)
    for one in asked:
        its.asked(one)
    its.confirming("fit", "Fitting")
    its.confirming("predict", "Predicting")
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
