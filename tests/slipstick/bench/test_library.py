"""Which bench of a folder belongs to a model and to recordings."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.errors import BadBench, UnknownName
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from tests.benches import COMPACT, HEAVY, TABLES


@pytest.fixture
def library(tmp_path: Path) -> Library:
    for name in ("heavy.toml", "compact.toml"):
        shutil.copy(TABLES / name, tmp_path)
    return Library(tmp_path)


def test_a_bench_is_found_by_its_physics_and_by_its_profiles(library: Library) -> None:
    assert library.benches() == ["compact", "heavy"]
    shipped = Recordings.open(TABLES / "measured.h5")
    assert library.bench_of_recordings(shipped) == "heavy"
    others = Recordings(COMPACT.conditions, np.full(len(COMPACT.conditions), 0.5))
    assert library.bench_of_recordings(others) == "compact"
    for bench in (HEAVY, COMPACT):
        assert library.bench_of_model(Model(bench.physics).with_parameters({"gear_ratio": 2.5}).physics) == bench.name


def test_none_and_more_than_one_bench_are_refused(library: Library) -> None:
    text = (TABLES / "heavy.toml").read_text()
    (library.folder / "copy.toml").write_text(text.replace('noise = "6 N m"', 'noise = "7 N m"'))
    with pytest.raises(UnknownName, match=r"More than one bench has .*\. Name the bench\. Known: compact, copy, heavy"):
        library.bench_of_model(HEAVY.physics)
    for name in ("copy", "heavy"):
        (library.folder / f"{name}.toml").unlink()
    with pytest.raises(UnknownName, match="No bench has the physics"):
        library.bench_of_model(HEAVY.physics)
    with pytest.raises(UnknownName, match="No bench has the current profiles"):
        library.bench_of_recordings(Recordings.open(TABLES / "measured.h5"))


def test_a_broken_bench_does_not_hide_the_others(library: Library) -> None:
    (library.folder / "broken.toml").write_text("[parameters")
    assert library.bench_of_model(HEAVY.physics) == "heavy"
    with pytest.raises(BadBench, match=r"broken\.toml is not TOML"):
        library.bench("broken")


def test_a_changed_file_is_read_again(library: Library) -> None:
    before = library.bench("heavy")
    path = library.folder / "heavy.toml"
    path.write_text(path.read_text().replace("gear_ratio = 3.2", "gear_ratio = 3.25"))
    assert library.bench("heavy").digest != before.digest
