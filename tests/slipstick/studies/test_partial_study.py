"""A study whose time budget ends: what the blocks have said by then, and no more."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from slipstick.interface.study import Study
from slipstick.recordings import Recordings
from slipstick.report.study.page import study_page
from slipstick.studies import StudyResult, StudySettings, unconfirmed
from slipstick.studies.figures import Figures
from slipstick.studies.record import from_dict
from slipstick.time_budget import TimeBudgetEnded
from tests.benches import HEAVY
from worker.study_text import study_text

SETTINGS = StudySettings()


@pytest.fixture(scope="module")
def few(few_recordings: Path) -> Recordings:
    return Recordings.open(few_recordings / "few.h5")


@pytest.fixture(scope="module")
def named(watched_study_of_few: tuple[Study, list[dict[str, Any]]]) -> list[dict[str, Any]]:
    """What is kept while the blocks are examined, and at last what is named."""
    content: list[dict[str, Any]] = json.loads(json.dumps(watched_study_of_few[1]))
    return content


def test_what_was_named_so_far_is_a_result_with_what_is_missing(few: Recordings, named: list[dict[str, Any]]) -> None:
    results = [unconfirmed(SETTINGS, HEAVY, few, its, 60.0)[0] for its in named]
    valve, laws, whole = (one.partial for one in results if one.partial)
    assert valve.done == ["the block “current → pressure”"]
    assert "the block “torque → output speed”" in valve.missing
    assert laws.missing[0] == "the block “pressure, speeds → torque while the plates close”"
    assert len(laws.missing) == 2
    assert whole.missing == ["the simulation of the whole bench, and with it coefficients, size and gap"]
    assert [(one.kind, len(one.findings)) for one in results] == [("open", 0), ("effect", 1), ("effect", 1)]
    assert results[0].sentence == "Partial answer, as the time budget ended. Nothing was found so far"
    assert results[2].sentence.endswith("(not confirmed by the simulation of the whole bench)")
    finding = results[2].findings[0]
    assert (finding.effect, finding.confirmation.simulated, finding.confirmation.agrees, finding.worth) == (
        "stribeck_friction", "not computed", None, None)
    assert results[2].gap is results[2].before is results[2].after is None


def test_a_block_that_may_change_is_said_to_be_unfinished(few: Recordings, named: list[dict[str, Any]]) -> None:
    result, _ = unconfirmed(SETTINGS, HEAVY, few, {**named[2], "is_complete": False}, 60.0)
    assert result.partial
    assert result.partial.missing[0] == "the rest of the examination of the blocks"


@pytest.mark.usefixtures("undrawn")
def test_report_and_text_begin_with_what_is_missing(few: Recordings, named: list[dict[str, Any]]) -> None:
    for its in named:
        result, figures = unconfirmed(SETTINGS, HEAVY, few, its, 60.0)
        output = json.loads(json.dumps({"result": asdict(result), "figure_data": asdict(figures), "seconds": {},
                                        "processor_seconds": {}}))
        assert from_dict(StudyResult, output["result"]) == result
        study = {"id": "few", "recordings": "few", "recordings_digest": few.digest, "settings": asdict(SETTINGS),
                 "submitted": "", "ended": ""}
        page = study_page(study, output)
        text = " ".join(study_text(result, from_dict(Figures, output["figure_data"]), SETTINGS).split())
        assert text.startswith("Warnings - Partial result: the time budget of 60 s ended before the job. Complete: the "
                               "block “current → pressure”")
        for content in (page, text):
            assert "Partial result:" in content
            assert "The simulation of the whole bench was not fitted." in content
            assert "The fitted simulation" not in content


def test_a_study_without_an_examined_block_has_no_result(few: Recordings) -> None:
    with pytest.raises(TimeBudgetEnded, match="The time budget of 5 s ended before a block of the model was examined"):
        unconfirmed(SETTINGS, HEAVY, few, None, 5.0)
