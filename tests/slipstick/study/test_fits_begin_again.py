"""The fits of the simulation begin again where a fit without findings is above the one with them."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.study import StudySettings, study

TERMS = SimpleNamespace(names=("load_drag",))


def a_fit(evidence: float, named: bool = False) -> SimpleNamespace:
    return SimpleNamespace(evidence=np.full(4, evidence / 4), fitted=SimpleNamespace(points=evidence),
                           block=SimpleNamespace(terms=TERMS if named else SimpleNamespace(names=())))


def fits(monkeypatch: pytest.MonkeyPatch, rounds: list[tuple[float, float]]) -> tuple[list[float], tuple[Any, ...]]:
    """The points at which fits began, and what comes of rounds with these evidences with and without the findings."""
    begun = list[float]()

    def confirmed(_traces: Any, _terms: Any, points: float, _enough: Any) -> tuple[Any, Any]:
        begun.append(points)
        return a_fit(-100.0), a_fit(rounds[len(begun) - 1][0], named=True)

    monkeypatch.setattr(study, "confirmed", confirmed)
    monkeypatch.setattr(study, "with_measured_laws", lambda formulas, *_: formulas)
    monkeypatch.setattr(study, "polished", lambda fit: fit)
    monkeypatch.setattr(study, "with_scatter_of", lambda *_: [a_fit(-90.0), a_fit(rounds[len(begun) - 1][1])])
    return begun, study._fits(StudySettings(), None, TERMS, {}, 0.0)  # type: ignore[arg-type]


def test_nothing_begins_again_where_the_findings_are_above(monkeypatch: pytest.MonkeyPatch) -> None:
    begun, (_, formulas, after, without) = fits(monkeypatch, [(-50.0, -60.0)])
    assert begun == [0.0]
    assert after is formulas
    assert len(without) == 2


def test_a_fit_without_findings_that_is_above_is_where_they_begin_again(monkeypatch: pytest.MonkeyPatch) -> None:
    begun, (_, _, after, _) = fits(monkeypatch, [(-50.0, -40.0), (-30.0, -35.0)])
    assert begun == [0.0, -40.0]
    assert after.evidence.sum() == -30.0


def test_findings_that_stay_below_are_no_part_of_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    begun, (before, formulas, after, without) = fits(monkeypatch, [(-50.0, -10.0)] * 5)
    assert len(begun) == 5
    assert before is formulas is after
    assert not after.block.terms.names
    assert not without
