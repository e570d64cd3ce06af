"""Constants are found, and changed for the time of a job alone."""

import pytest

from evidence.constants import list_constants, run_job, scale
from slipstick.engine import fit, selection


@pytest.mark.parametrize(("value", "factor", "scaled"), [
    (12.0, 0.5, 6.0), (3, 0.5, 2), (1, 0.5, 1), ((1, 4), 2.0, (2, 8)), (0.9, 2.0, 0.95), (0.9, 0.5, 0.8)])
def test_scaling(value: object, factor: float, scaled: object) -> None:
    assert scale(value, factor) == pytest.approx(scaled)


def test_all_that_is_named_in_capitals_is_listed_once() -> None:
    listed = list_constants()
    assert len(listed) == len(set(listed))
    assert {("settings", "nats"), ("fit", "HOPED"), ("bases", "TIMES"), ("noise", "_BEGIN")} <= set(listed)
    assert ("selection", "HOPED") not in listed, "which reads that of the fit"
    assert ("laws", "GAIN") not in listed, "which is a word"


def test_constant_is_changed_in_all_modules_that_read_it(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = list[tuple[float, float]]()
    monkeypatch.setattr("evidence.constants._answers", lambda settings: seen.append((fit.HOPED, selection.HOPED)))
    usual = fit.HOPED
    run_job("fit", "HOPED", 2.0)
    assert seen == [(2 * usual, 2 * usual)]
    assert fit.HOPED == selection.HOPED == usual
