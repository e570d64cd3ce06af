"""Shipped benches and recordings: opened by name in any folder, and the sample is a part of the measured recordings."""

import shutil
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.errors import UnknownName
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.storage.shipped import file_of
from slipstick.studies import StudySettings, conclude, examine
from tests.benches import COMPACT, HEAVY, TABLES

DESIGN = ("current_profile", "load_inertia", "brake_torque", "motor_speed")


def test_a_bench_is_opened_by_its_name_in_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "heavy").mkdir()  # such as a folder of results
    for name, bench in (("heavy", HEAVY), ("compact", COMPACT), ("compact.toml", COMPACT), (Path("heavy"), HEAVY)):
        assert Bench.open(name).digest == bench.digest
    shutil.copy(TABLES / "compact.toml", tmp_path / "heavy.toml")
    assert Bench.open("heavy.toml").digest == COMPACT.digest  # a file of one's own goes before
    assert Bench.open(TABLES / "heavy.toml").digest == HEAVY.digest


def test_an_unknown_bench_lists_the_shipped_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UnknownName, match=r"no bench file 'heavi'\. Did you mean 'heavy'\? Known: compact, heavy\."):
        Bench.open("heavi")
    shutil.copy(TABLES / "compact.toml", tmp_path / "mine.toml")
    with pytest.raises(UnknownName, match=r"Did you mean 'mine\.toml'\? Known: compact, heavy, mine\.toml\."):
        Bench.open("mind.toml")
    with pytest.raises(UnknownName, match=r"Known: compact, heavy\."):
        Bench.open(tmp_path / "elsewhere" / "heavy.toml")  # a path is not a name
    assert file_of(tmp_path / "elsewhere" / "heavy", ".toml") == tmp_path / "elsewhere" / "heavy"


def test_the_sample_is_every_fourth_of_the_measured_engagements() -> None:
    sample, measured = Recordings.open(file_of("sample", ".h5")), Recordings.open(TABLES / "measured.h5")
    levels = {name: np.unique(getattr(measured.conditions, name), return_inverse=True)[1] for name in DESIGN}
    rows = np.flatnonzero((levels["current_profile"] + levels["motor_speed"] + 3 * levels["load_inertia"]
                           + levels["brake_torque"]) % 4 == 0)
    part = measured.take(rows)
    assert len(sample) == len(measured) / 4
    assert sample.conditions.digest == part.conditions.digest
    assert np.array_equal(sample.measured_time, part.measured_time)
    assert sample.signals is not None
    assert part.signals is not None
    for name in ("time", *SIGNAL_UNITS):
        assert np.array_equal(getattr(sample.signals, name), getattr(part.signals, name)), name
    assert measured.run_order is not None
    assert np.array_equal(np.argsort(sample.run_order), np.argsort(measured.run_order[rows]))
    assert "every fourth of measured.h5" in sample.description
    assert "Simulated" in sample.description


def test_the_sample_covers_the_conditions_evenly() -> None:
    conditions = Recordings.open(TABLES / "sample.h5").conditions
    for pair in combinations(DESIGN, 2):
        values, counts = np.unique([getattr(conditions, name) for name in pair], axis=1, return_counts=True)
        assert values.shape[1] == np.prod([len(np.unique(getattr(conditions, name))) for name in pair])
        assert np.ptp(counts) <= ("motor_speed" in pair)  # 54 is no multiple of its 4 values


@pytest.mark.slow
def test_a_study_of_the_sample_names_the_effect_that_is_in_it() -> None:
    settings, sample = StudySettings(), Recordings.open(TABLES / "sample.h5")
    result, _ = conclude(settings, HEAVY, sample, examine(settings, HEAVY, sample))
    finding, = result.findings
    assert finding.effect == "stribeck_friction"
    assert finding.confidence > 0.9
