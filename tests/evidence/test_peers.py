"""Peers of the engine: they find a strong law, are judged as the engine is, and are counted in one table."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from evidence.answer import LawOfPair
from evidence.judge import judge
from evidence.peers.__main__ import measure_law, summarise
from evidence.rates import Entry
from evidence.runner import answer_case
from evidence.suites import OTHER_MACHINES

DRIFT = 3002  # the flow of the pump changes with time
WEAR = 3034  # the outlet of the second tank changes with the run order
NULL = 1006


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("evidence")


@pytest.fixture(scope="module")
def drift(work: Path) -> Entry:
    return answer_case("residuals", OTHER_MACHINES, DRIFT, work)


@pytest.mark.slow
def test_residuals_name_a_strong_law_and_leave_a_recording_without_one_alone(work: Path, drift: Entry) -> None:
    assert not drift.answer.error
    assert judge(drift.answer, drift.truth).right_first
    null = answer_case("residuals", OTHER_MACHINES, NULL, work)
    assert not null.answer.error
    assert judge(null.answer, null.truth).silent


def test_sindy_names_a_strong_law(work: Path) -> None:
    pytest.importorskip("pysindy", reason="PySINDy, of the extra 'peers', is not installed")
    entry = answer_case("sindy", OTHER_MACHINES, WEAR, work)
    assert not entry.answer.error
    assert judge(entry.answer, entry.truth).right_first


@pytest.mark.slow
def test_answers_are_counted_right_and_false(drift: Entry) -> None:
    alarm = replace(drift, truth=replace(drift.truth, hidden=()))
    silent = replace(alarm, answer=replace(alarm.answer, findings=(), laws=()))
    summary = summarise([drift, alarm, silent])
    assert (summary.effects, summary.right_first, summary.in_answer) == (1, 1, 1)
    assert (summary.nulls, summary.alarms) == (2, 1)
    assert summary.errors == 0


@pytest.mark.slow
def test_the_error_of_a_law_is_that_over_the_visited_range(drift: Entry) -> None:
    [hidden] = drift.truth.hidden
    law = LawOfPair(hidden.pair, hidden.grid, (np.array(hidden.change) - 1).tolist(), [0.0] * len(hidden.grid), True,
                    "nothing")
    exact = replace(drift.answer, laws=(law,))
    larger = replace(exact, laws=(replace(law, change=(1.3 * np.array(law.change)).tolist()),))
    assert measure_law(exact, drift.truth) == pytest.approx(0.0, abs=1e-9)
    assert measure_law(larger, drift.truth) == pytest.approx(0.3)
    assert measure_law(replace(exact, laws=()), drift.truth) is None
