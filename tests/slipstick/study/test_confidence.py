"""Confidence is a count of right names among findings with evidence of the same kind."""

from typing import get_args

import numpy as np
import pytest

from slipstick.naming.selection import Finding, Rival
from slipstick.study.confidence import BY_LIST, Kind, confidence, kind_of

RIVAL = Rival(("friction coefficient", "heat"), 30.0, 1.0)


def finding(quantity: str, *rivals: Rival) -> Finding:
    return Finding(("contact",), (quantity, "slip"), np.full(30, 2.0), rivals)


@pytest.mark.parametrize(("quantity", "has_rivals", "is_single", "kind"), [
    ("friction coefficient", False, True, "the only finding"),
    ("clearance", False, True, "the only finding, in the closing piston"),
    ("clearance", False, False, "one of several findings"),
    ("friction coefficient", True, True, "a rival is near"),
    ("friction coefficient", True, False, "a rival is near")])
def test_the_kind_is_that_of_what_else_was_found(quantity: str, has_rivals: bool, is_single: bool, kind: str) -> None:
    assert kind_of(quantity, has_rivals, is_single) == kind


def test_every_list_counts_every_kind() -> None:
    for counts in BY_LIST.values():
        assert set(counts) == set(get_args(Kind))
        assert all(0 <= right <= of for right, of in counts.values())


def test_the_share_is_of_all_lists_by_the_rule_of_succession() -> None:
    right, of = (sum(counts["the only finding"][place] for counts in BY_LIST.values()) for place in (0, 1))
    share, words = confidence(finding("friction coefficient"), is_single=True)
    assert share == (right + 1) / (of + 2)
    assert words == f"the only finding: {right} of {of}"
    assert confidence(finding("friction coefficient", RIVAL), is_single=True)[1].startswith("a rival is near: ")
