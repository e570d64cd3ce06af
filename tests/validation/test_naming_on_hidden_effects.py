"""Naming on recordings of the independent bench: the effect, nothing where there is nothing, and bad runs set aside."""

from pathlib import Path

import numpy as np
import pytest

from slipstick.errors import InvalidValue
from slipstick.naming import answer, name
from slipstick.recordings import Recordings
from tests.benches import BENCHES, HEAVY
from tests.validation.hidden import Case, write

COUNT = 36
ON = {bench.name: bench for bench in BENCHES}


def recorded(folder: Path, case: Case) -> Recordings:
    write(folder / "case.h5", case)
    return Recordings.open(folder / "case.h5")


@pytest.mark.slow
def test_nothing_is_named_on_another_bench_where_everything_scatters(tmp_path: Path) -> None:
    case = Case(seed=711, count=COUNT, bench="compact", world="any")
    found = name(ON["compact"], recorded(tmp_path, case))
    assert not found.findings
    assert all(0.9 < chi_square < 1.12 for chi_square in found.chi_square.values())


def test_hidden_effects_are_named_and_what_no_effect_explains_is_unlisted(tmp_path: Path) -> None:
    case = Case({"thermal_fade": 0.2, "load_waves_in_time": 60.0}, seed=712, count=COUNT)
    found = name(HEAVY, recorded(tmp_path, case))
    named = {answer(one, found.measured[one.pair]).effect or one.pair for one in found.findings}
    assert named == {"thermal_fade", ("load torque", "time")}
    waves = found.measured["load torque", "time"]
    true = 60.0 * np.sin(2 * np.pi * waves.x / 0.7)
    assert np.corrcoef(waves.change, true)[0, 1] > 0.9 > np.corrcoef(waves.change, np.roll(true, 1))[0, 1]
    assert all(0.9 < chi_square < 1.12 for chi_square in found.chi_square.values())


def test_recordings_that_cannot_tell_are_refused(tmp_path: Path) -> None:
    few = recorded(tmp_path, Case(seed=713, count=12))
    with pytest.raises(InvalidValue, match="12 engagements"):
        name(HEAVY, few)
    with pytest.raises(InvalidValue, match="12 engagements"):
        name(HEAVY, Recordings(few.conditions, few.measured_time))
