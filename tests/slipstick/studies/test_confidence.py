"""Confidence follows from the lead and what else was found, as the findings of other groups do."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import chi2

from slipstick.naming.selection import Finding, Rival
from slipstick.studies.confidence import (
    BANDS,
    LEAST,
    Evidence,
    are_reported,
    confidence,
    count_right,
    evidence_of,
    read_findings,
    share_of,
)

LEADS = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0)


@pytest.mark.parametrize("alone", [True, False])
def test_confidence_rises_with_the_lead_up_to_the_naming_limit(alone: bool) -> None:
    sure = [confidence(Evidence(lead, alone, further=False, share=1.0)) for lead in (*LEADS, 50.0)]
    assert (np.diff(sure[:-1]) > 0).all()
    assert sure[-2] == sure[-1]


def test_a_lead_is_worth_more_where_nothing_else_is_found_and_with_a_larger_share() -> None:
    def rise(alone: bool, share: float) -> float:
        sure = [confidence(Evidence(lead, alone, further=False, share=share)) for lead in (4.0, 32.0)]
        return float(np.diff(np.log(np.divide(sure, 1 - np.array(sure))))[0])

    assert rise(alone=True, share=1.0) > rise(alone=False, share=1.0) > rise(alone=False, share=0.1) > 0


def test_a_further_finding_is_less_likely() -> None:
    plain = Evidence(8.0, alone=False, further=False, share=1.0)
    assert confidence(plain._replace(further=True)) < confidence(plain)


def test_a_weak_finding_beside_strong_ones_is_less_likely() -> None:
    weak = Evidence(8.0, alone=False, further=False, share=0.01)
    assert confidence(weak) < confidence(weak._replace(share=0.5))


def test_a_rare_pair_is_less_likely() -> None:
    plain = Evidence(8.0, alone=True, further=False, share=1.0)
    assert confidence(plain._replace(rare=True)) < 0.7 * confidence(plain)
    assert confidence(plain) > 0.5


def test_a_lead_below_zero_is_no_lead() -> None:
    plain = Evidence(0.0, alone=True, further=False, share=1.0)
    assert confidence(plain._replace(lead=-3.0)) == confidence(plain)


def test_evidence_of_a_finding_is_that_beside_the_others() -> None:
    gain, torque = np.full(30, 8.0), "load torque"
    first = Finding(("load",), (torque, "output speed"), gain, next_best=Rival((torque, "time"), 9.0, 5.0))
    second = Finding(("load",), (torque, "time"), 0.5 * gain, rivals=(Rival((torque, "slip"), 99.0, 1.0),))
    assert evidence_of(first, [first]) == Evidence(5.0, alone=True, further=False, share=1.0)
    assert evidence_of(first, [first, second]) == Evidence(5.0, alone=False, further=False, share=2 / 3)
    beside = Evidence(second.errors, alone=False, further=True, share=1 / 3)
    assert evidence_of(second, [first, second]) == beside


def test_findings_beside_the_largest_must_be_likely_enough() -> None:
    largest, beside = (Evidence(8.0, alone=False, further=False, share=share) for share in (0.7, 0.3))
    doubtful = Evidence(1.0, alone=False, further=True, share=0.01)
    assert confidence(doubtful) < LEAST < confidence(beside)
    assert are_reported([largest, doubtful, beside], [70.0, 1.0, 30.0]) == [True, False, True]
    assert are_reported([beside, largest], [30.0, 70.0]) == [True, True]
    assert are_reported([doubtful], [1.0]) == [True]
    rare = largest._replace(rare=True)
    assert are_reported([rare, doubtful], [70.0, 1.0]) == [False, True]
    assert are_reported([rare], [70.0]) == [True]
    assert are_reported([], []) == []


def test_the_largest_gains_most_and_need_not_have_the_largest_share() -> None:
    """A twist that nothing else can have left, beside a friction that gains more and is unlikely."""
    friction, twist = Evidence(0.0, alone=False, further=False, share=0.5), Evidence(9.0, False, False, 1.0)
    assert confidence(friction) < LEAST < confidence(twist)
    assert are_reported([friction, twist], [500.0, 50.0]) == [True, True]
    assert are_reported([friction, twist], [50.0, 500.0]) == [False, True]


def test_a_share_is_among_the_findings_that_may_leave_something_in_its_blocks() -> None:
    """Nothing of the clutch shows in the valve or after lock-up; what the valve leaves shows in the clutch."""
    def found(block: str, quantity: str, nats: float) -> Finding:
        return Finding((block,), (quantity, "time"), np.full(10, nats / 10))

    current, pressure = found("valve", "valve current", 30.0), found("valve", "pressure sensor", 10.0)
    friction, load = found("clutch", "friction coefficient", 900.0), found("load", "load torque", 60.0)
    twist, every = found("lock", "stick torque", 50.0), [found("lock", "input speed sensor", 150.0)]
    every += [current, pressure, friction, load, twist]
    shares = [share_of(one, every) for one in (current, pressure, twist, friction, load)]
    assert shares == pytest.approx([0.75, 0.25, 0.25, 0.75, 0.05])
    joint = Finding(("input", "lock"), ("input speed sensor", "lag"), np.full(10, 15.0))
    assert share_of(joint, [joint, friction]) == pytest.approx(150 / 1050)


def test_the_mean_confidence_is_the_share_of_right_findings() -> None:
    """A score equation of a logistic regression."""
    every = [pair for its in read_findings().values() for pair in its]
    assert sum(is_right - confidence(evidence) for evidence, is_right in every) == pytest.approx(0, abs=1e-6)


def test_a_group_does_not_predict_itself() -> None:
    which, rows = next(iter(read_findings().items()))
    assert not np.allclose([confidence(one, which) for one, _ in rows], [confidence(one) for one, _ in rows])


def test_evidence_predicts_the_findings_of_other_groups_better_than_their_share_does() -> None:
    gain = 0.0
    for which, rows in read_findings().items():
        others = np.mean([is_right for other, its in read_findings().items() if other != which for _, is_right in its])
        for evidence, is_right in rows:
            sure = confidence(evidence, which)
            gain += np.log(sure / others) if is_right else np.log((1 - sure) / (1 - others))
    assert 2 * gain > chi2.ppf(0.99, 6)


def test_every_finding_is_counted_in_one_band() -> None:
    each = [count_right((low + high) / 2) for low, high in pairwise(BANDS)]
    assert [(one.lower, one.upper) for one in each] == list(pairwise(BANDS))
    rows = [is_right for its in read_findings().values() for _, is_right in its]
    assert sum(one.of for one in each) == len(rows)
    assert sum(one.right for one in each) == sum(rows)
    assert count_right(1.0) == each[-1]
