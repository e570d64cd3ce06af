"""Confidence is a count of right names among findings with evidence of the same kind."""

from typing import get_args

import numpy as np
import pytest

from slipstick.naming.selection import Finding, Rival
from slipstick.study.confidence import BY_LIST, Kind, confidence, kind_of

RIVAL = Rival(("friction coefficient", "heat"), 30.0, 1.0)


STRIBECK, AIR, BRAKE = ("friction coefficient", "slip"), ("clearance", "pressure"), ("brake torque", "output speed")


def finding(pair: tuple[str, str], *rivals: Rival, nats: float = 60.0) -> Finding:
    return Finding(("contact",), pair, np.full(30, nats / 30), rivals)


@pytest.mark.parametrize(("pair", "rivals", "is_strongest", "is_all", "kind"), [
    (STRIBECK, (), True, True, "the only finding"),
    (AIR, (), True, False, "the strongest of several findings"),
    (AIR, (), False, False, "a weaker one of several findings"),
    (STRIBECK, (RIVAL.pair,), True, True, "a rival is near"),
    (STRIBECK, (RIVAL.pair,), False, False, "a rival is near"),
    (BRAKE, (("load torque", "output speed"),), True, True, "the only finding"),  # the same effect
    (BRAKE, (("load torque", "output speed"), ("load torque", "time")), True, True, "a rival is near")])
def test_the_kind_is_that_of_what_else_was_found(pair: tuple[str, str], rivals: tuple[tuple[str, str], ...],
                                                 is_strongest: bool, is_all: bool, kind: str) -> None:
    assert kind_of(pair, rivals, is_strongest, is_all) == kind


def test_every_list_counts_every_kind() -> None:
    for counts in BY_LIST.values():
        assert set(counts) == set(get_args(Kind))
        assert all(0 <= right <= of for right, of in counts.values())


def test_the_share_is_of_all_lists_by_the_rule_of_succession() -> None:
    right, of = (sum(counts["the only finding"][place] for counts in BY_LIST.values()) for place in (0, 1))
    share, words = confidence(finding(STRIBECK), [finding(STRIBECK)], [])
    assert share == (right + 1) / (of + 2)
    assert words == f"the only finding: {right} of {of}"
    assert confidence(finding(STRIBECK, RIVAL), [finding(STRIBECK, RIVAL)], [])[1].startswith("a rival is near: ")
    for findings, blocks, kind in (([finding(STRIBECK), finding(AIR, nats=90)], [], "a weaker one"),
                                   ([finding(STRIBECK), finding(AIR, nats=30)], [], "the strongest of several"),
                                   ([finding(STRIBECK)], ["clutch"], "the strongest of several")):
        assert confidence(findings[0], findings, blocks)[1].startswith(kind)
