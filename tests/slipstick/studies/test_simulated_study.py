"""What a study simulates: fits that begin again, and conditions as the blocks have measured them."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipstick.studies import StudySettings, study
from slipstick.studies.conditions import by_level, with_measured
from tests.benches import HEAVY

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


# Conditions as the blocks have measured them: what is simulated, and what is reported of each stated level.


STATED = HEAVY.conditions.take(range(0, 216, 5))


def test_what_was_found_changes_the_stated_values_and_nothing_else() -> None:
    off = 0.02 * np.sin(np.arange(len(STATED)))
    measured = with_measured(STATED, {"motor_speed": off, "current_gain": off})
    np.testing.assert_allclose(measured.motor_speed / STATED.motor_speed - 1, off, atol=1e-12)
    assert replace(measured, motor_speed=STATED.motor_speed).digest == STATED.digest


def test_what_no_bench_could_have_is_not_a_measured_condition() -> None:
    off = np.zeros(len(STATED))
    off[:4] = -1.2, 2.9, np.nan, 0.1
    measured = with_measured(STATED, {"load_inertia": off})
    np.testing.assert_allclose(measured.load_inertia / STATED.load_inertia - 1, [0, 0, 0, 0.1, *off[4:]], atol=1e-12)


def test_each_level_has_its_deviation_and_its_scatter() -> None:
    levels = np.unique(STATED.motor_speed)
    off = np.where(STATED.motor_speed == levels[0], 0.03, -0.01)
    off[np.flatnonzero(STATED.motor_speed == levels[1])[::2]] += 0.004
    found = list(by_level(STATED, with_measured(STATED, {"motor_speed": off})))
    assert [one.stated for one in found] == levels.tolist()
    assert {one.name for one in found} == {"motor_speed"}
    assert found[0].deviation == pytest.approx(0.03)
    assert found[0].scatter == pytest.approx(0, abs=1e-12)
    assert found[1].deviation == pytest.approx(-0.008, abs=5e-4)
    assert found[1].scatter == pytest.approx(0.002, rel=0.05)
    assert sum(one.engagements for one in found) == len(STATED)


def test_a_condition_without_levels_is_not_listed() -> None:
    stated = replace(STATED, load_inertia=STATED.load_inertia + 0.01 * np.arange(len(STATED)))
    assert not list(by_level(stated, with_measured(stated, {"load_inertia": np.full(len(stated), 0.01)})))


def test_a_level_of_zero_has_no_relative_deviation() -> None:
    stated = replace(STATED, brake_torque=np.where(STATED.brake_torque < 30, 0.0, STATED.brake_torque))
    found = list(by_level(stated, with_measured(stated, {"brake_torque": np.full(len(stated), 0.01)})))
    assert found
    assert all(one.stated > 0 for one in found)
