"""Rates of naming count what a study would report: findings beside the largest only where they are likely enough."""

from typing import Any

import pytest

from benchmarks.naming_rates import accuracy, findings_of, judged, reported
from slipstick.study.confidence import Evidence, confidence

LIST = "a list that no confidence was fitted to"


def finding(pair: tuple[str, str], lead: float, *, further: bool, rivals: tuple[tuple[str, str], ...] = (),
            nats: float = 100.0) -> Any:
    return {"pair": list(pair), "lead": lead, "nats": nats, "further": further, "rare": False, "effect": "",
            "rivals": [list(one) for one in rivals]}


def case(*findings: Any) -> dict[str, Any]:
    hidden = {"name": "quadratic", "pair": ["load torque", "output speed"], "listed": True}
    nats = sum(its["nats"] for its in findings)
    return {"case": "x", "hidden": [hidden], "findings": [its | {"share": its["nats"] / nats} for its in findings],
            "unexplained": []}


RIGHT = finding(("load torque", "output speed"), 9.0, further=False)
WRONG = finding(("input torque", "time"), 1.5, further=True, nats=5.0)


@pytest.fixture(autouse=True)
def effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """The hidden benches know no effect of this name."""
    monkeypatch.setattr("benchmarks.naming_rates.LAWS", {})


def test_an_unlikely_smaller_finding_is_none_and_its_block_is_not_explained() -> None:
    both = case(RIGHT, WRONG)
    assert judged(both)["wrong"] == 1
    found = reported(both, LIST)
    assert [its["pair"] for its in found["findings"]] == [RIGHT["pair"]]
    assert [its["pair"] for its in found["unlikely"]] == [WRONG["pair"]]
    assert found["unexplained"] == ["input"]
    assert (judged(found)["found"], judged(found)["wrong"]) == (1, 0)


def test_the_largest_finding_is_reported_however_unlikely() -> None:
    alone = case(finding(("input torque", "time"), 1.0, further=False))
    found = reported(alone, LIST)
    assert judged(found)["wrong_alone"] == 1
    assert found["unlikely"] == []


def test_confidence_is_that_of_all_findings_of_a_case() -> None:
    found = reported(case(RIGHT, WRONG), LIST)
    assert found["findings"][0]["confidence"] == confidence(Evidence(9.0, False, False, 100 / 105), LIST)
    assert found["findings"][0]["right"]


def test_a_tie_is_right_if_one_of_it_is() -> None:
    tied = finding(("input torque", "time"), 1.0, further=False, rivals=(("load torque", "output speed"),))
    assert findings_of(case(tied)) == [(Evidence(1.0, True, False, 1.0), True)]


def test_laws_are_as_far_off_as_they_state_and_as_an_oracle_would_be() -> None:
    pair = ["load torque", "output speed"]
    entries = [{"hidden": [{"pair": ["line pressure", "slip"], "seen": 70.0}, {"pair": pair, "seen": seen}],
                "laws": [{"pair": pair, "share": share, "stated": 0.1, "held": held}]}
               for seen, share, held in ((2.0, 0.1, 1.0), (4.0, 0.14, 0.8), (4.0, 0.9, 0.0))]
    rows = {row[0]: row[1:3] for row in accuracy([*entries, {"hidden": [], "laws": []}])}
    of = "laws of right pairs: "
    assert [rows[f"{of}RMS off by at most {most} times the stated error"] for most in ("1", "1.5", "3")] == [
        [1, 3], [2, 3], [2, 3]]
    averages = {row[0].removeprefix(of): row[3] for row in accuracy(entries)[3:]}
    assert averages == {"off by, as a share of the law: median": 0.14,
                        "off by, over the error of an oracle that knows the form: median": 2.8,
                        "share of the visited range in the 90 % band: mean": 0.6}
