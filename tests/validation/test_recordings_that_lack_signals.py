"""Studies of recordings in which signals were not measured: the blocks that are left answer, the others are closed."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.naming import answer, name
from slipstick.naming.study import Naming
from slipstick.recordings import Recordings
from slipstick.report.study.page import study_page
from slipstick.studies import StudyResult, StudySettings, conclude, examine
from slipstick.studies.figures import Figures
from tests.benches import HEAVY
from tests.hidden_laws import CONVERTER_LAGS, LOAD_DRAGS, SUPPLY_DROOPS, law, record

COUNT = 24


FRICTION_FALLS = law("friction_coefficient", "slip", lambda v: 1 + 0.5 * np.exp(-((v / 14) ** 1.3)))
"""Strong enough to show in whole signals, where no block can be tested."""
LAWS = {"quadratic_load_drag": LOAD_DRAGS, "supply_droop": SUPPLY_DROOPS, "converter_lag": CONVERTER_LAGS,
        "stribeck_friction": FRICTION_FALLS}


def recorded(folder: Path, effects: list[str], without: list[str], seed: int = 41) -> Recordings:
    found = record(folder, *(LAWS[effect] for effect in effects), seed=seed, count=COUNT)
    assert found.signals is not None
    return replace(found, signals=replace(found.signals, **dict.fromkeys(without)))


def effects_of(found: Naming) -> list[str]:
    return [answer(one, found.measured.get(one.pair)).effect for one in found.findings]


@pytest.mark.parametrize(("effects", "without", "blocks"), [
    pytest.param(["quadratic_load_drag"], ["pressure"], ["load", "input", "lock"], marks=pytest.mark.slow),
    (["supply_droop"], ["input_speed", "output_speed", "output_torque"], ["valve"]),
    (["supply_droop"], ["input_speed", "output_speed"], ["valve"]),
    pytest.param(["converter_lag"], ["pressure", "output_speed"], ["input"], marks=pytest.mark.slow),
])
def test_the_blocks_between_recorded_signals_name_their_effect(
        tmp_path: Path, effects: list[str], without: list[str], blocks: list[str]) -> None:
    found = name(HEAVY, recorded(tmp_path, effects, without))
    assert (effects_of(found), list(found.chi_square)) == (effects, blocks)
    assert not found.unexplained


@pytest.mark.parametrize("without", [["pressure"], pytest.param(["output_torque"], marks=pytest.mark.slow),
                                     pytest.param(["input_speed"], marks=pytest.mark.slow)])
def test_nothing_is_named_where_nothing_is_hidden_and_a_signal_is_missing(tmp_path: Path, without: list[str]) -> None:
    found = name(HEAVY, recorded(tmp_path, [], without, seed=11))
    assert (found.findings, found.unexplained) == ((), ())


@pytest.mark.slow
def test_an_effect_of_a_closed_block_is_missing_and_not_named(tmp_path: Path) -> None:
    result, figures, recordings = studied(tmp_path, ["stribeck_friction"], ["pressure"])
    assert (result.kind, result.findings) == ("unlisted", [])
    assert "missing that shows in the " in result.sentence
    assert ", but in no block that could be tested" in result.sentence
    assert "the recordings have no pressure" in result.sentence
    assert {one.name: one.missing for one in result.closed} == {
        block: ["pressure"] for block in ("valve", "contact", "clutch")}
    assert "pressure" not in result.after.chi_square
    assert result.explanations[0].effect == "stribeck_friction"
    html = study_page(
        {"id": "partial", "recordings": "partial", "recordings_digest": recordings.digest,
         "settings": asdict(StudySettings()), "submitted": "2026-11-01T10:00:00Z", "ended": "2026-11-01T10:00:12Z"},
        json.loads(json.dumps({"result": result.to_dict(), "figure_data": asdict(figures), "seconds": {"name": 2.0},
                               "processor_seconds": {"name": 2.0}}, allow_nan=False)))
    assert "Not measured: pressure." in html
    assert "not tested: pressure not measured" in html


@pytest.mark.slow
def test_without_both_ends_of_any_block_the_simulation_answers(tmp_path: Path) -> None:
    without = ["pressure", "input_speed", "output_speed"]
    result, _, _ = studied(tmp_path, [], without)
    assert (result.kind, result.blocks, result.explanations) == ("none", [], [])
    result, _, _ = studied(tmp_path, ["stribeck_friction"], without)
    assert (result.kind, result.blocks) == ("unlisted", [])
    assert result.explanations[0].effect == "stribeck_friction"


def studied(folder: Path, effects: list[str], without: list[str]) -> tuple[StudyResult, Figures, Recordings]:
    settings, recordings = StudySettings(), recorded(folder, effects, without)
    return *conclude(settings, HEAVY, recordings, examine(settings, HEAVY, recordings)), recordings
