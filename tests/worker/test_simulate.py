"""The command `simulate`: recordings of a simulated bench."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.naming import name
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.simulated_recordings import simulated_recordings
from tests.benches import COMPACT, HEAVY, NOMINAL, TABLES
from worker.__main__ import main

STRIBECK = {"strength": 0.15, "decay_speed": 20.0}


def test_recordings_are_written_that_can_be_opened_and_are_the_same_again(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [tmp_path / "new" / f"{name}.h5" for name in ("one", "two", "three")]
    for file, seed in zip(files, ("1", "1", "2"), strict=True):
        assert main(["simulate", "--bench", str(TABLES / "compact.toml"), "--engagements", "100", "--seed", seed,
                     "--effect", "seal_friction", "--effect", "supply_droop=-0.5", "--out", str(file)]) == 0
    one, again, other = (Recordings.open(file) for file in files)
    assert one.digest == again.digest != other.digest
    assert len(one) == 100
    assert one.run_order is not None
    assert not np.array_equal(one.run_order, np.arange(100))
    np.testing.assert_array_equal(one.conditions.motor_speed[:10], one.conditions.motor_speed[90:])  # 90 conditions
    assert one.signals is not None
    assert one.signals.time[1] == pytest.approx(COMPACT.sample_time)
    assert f"python -m worker study {files[0]} --bench {TABLES / 'compact.toml'}" in capsys.readouterr().out


def test_scatter_noise_and_resolution_are_those_of_the_bench_and_of_the_options() -> None:
    conditions = HEAVY.conditions.take([100] * 200)
    exact = simulated_recordings(HEAVY, NOMINAL, conditions, scatter=0, noise=0)
    assert exact.signals is not None
    resolution = HEAVY.sensors["pressure"].resolution or 0.0
    assert np.ptp(exact.signals["pressure"], axis=0).max() <= resolution
    time = ensemble.shifting_times(NOMINAL, HEAVY.conditions.take([100]))[0][0, 0]
    assert exact.measured_time == pytest.approx(time, abs=1e-3)
    noisy = simulated_recordings(HEAVY, NOMINAL, conditions, scatter=0, noise=2)
    assert noisy.signals is not None
    for signal in SIGNAL_UNITS:
        std = (noisy.signals[signal] - exact.signals[signal]).std()
        assert std == pytest.approx(2 * (HEAVY.sensors[signal].noise or 0.0), rel=0.05)
    scattered = simulated_recordings(HEAVY, NOMINAL, conditions, scatter=0.02, noise=0)
    assert 10 * np.std(exact.measured_time) < np.std(scattered.measured_time) < 0.2 * time


def test_what_cannot_be_simulated_is_refused(tmp_path: Path) -> None:
    deaf = replace(HEAVY, sensors={**HEAVY.sensors, "pressure": replace(HEAVY.sensors["pressure"], noise=None)})
    with pytest.raises(InvalidValue, match="states no noise of pressure"):
        simulated_recordings(deaf, NOMINAL, HEAVY.conditions)
    with pytest.raises(InvalidValue, match="do not lock"):
        simulated_recordings(HEAVY, NOMINAL, HEAVY.conditions, scatter=3.0)


@pytest.mark.parametrize(("options", "message"), [
    (["--effect", "stribek_friction"], "Did you mean 'stribeck_friction'?"),
    (["--effect", "stribeck_friction=strong"], "Write stribeck_friction, or stribeck_friction=MULTIPLE"),
    (["--effect", "stribeck_friction=99"], "Take a multiple with which it is within"),
    (["--engagements", "0"], "Give --engagements 1 or more"),
    (["--scatter", "-1"], "Give numbers of 0 or more"),
    (["--out", "recordings.csv"], "Give --out a path that ends in .h5")])
def test_invalid_options_are_refused(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], message: str) -> None:
    assert main(["simulate", "--out", str(tmp_path / "new.h5"), *options]) == 1
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_recordings_of_others_are_not_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "recordings.h5"
    shutil.copy(TABLES / "measured.h5", file)
    assert main(["simulate", "--engagements", "2", "--out", str(file)]) == 1
    assert "has no simulated recordings" in capsys.readouterr().err
    assert file.read_bytes() == (TABLES / "measured.h5").read_bytes()
    file.unlink()
    for _ in range(2):
        assert main(["simulate", "--engagements", "2", "--out", str(file)]) == 0


@pytest.mark.slow
def test_a_study_names_the_simulated_effect() -> None:
    model = Model(HEAVY.physics).with_effect("stribeck_friction", STRIBECK)
    found = name(HEAVY, simulated_recordings(HEAVY, model, HEAVY.conditions.take(range(0, 216, 6))))
    assert [one.pair for one in found.findings] == [("friction coefficient", "slip")]
    assert not name(HEAVY, simulated_recordings(HEAVY, NOMINAL, HEAVY.conditions.take(range(0, 216, 6)))).findings
