import re

import numpy as np
import pytest

from slipstick.building.surrogates import HELD_OUT
from slipstick.clutch.ensemble import TIGHT, Simulator
from slipstick.interface.surrogate import surrogate as train_surrogate
from slipstick.table import Surrogate, Table
from tests.benches import HEAVY, NOMINAL
from worker.__main__ import main

SPANS = ("pressure_bias=0.8:1.2", "initial_position=0.8:1.2", "friction_coefficient=0.9:1.1")
SMALL = ("--runs", "1000", "--steps", "1000")


@pytest.fixture(scope="module")
def recordings(six_conditions, tmp_path_factory):
    """The six conditions as a recordings file."""
    path = tmp_path_factory.mktemp("recordings") / "few.csv"
    columns = np.column_stack([six_conditions.current_profile, six_conditions.motor_speed, six_conditions.load_inertia,
                               six_conditions.brake_torque, np.ones(len(six_conditions))])
    rows = [",".join([str(int(row[0])), *(repr(float(value)) for value in row[1:])]) for row in columns]
    path.write_text("\n".join(["current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],"
                               "shifting_time [s]", *rows]) + "\n")
    return path


def run_command(recordings, out, *options, spans=SPANS):
    axes = [part for span in spans for part in ("--axis", span)]
    return main(["surrogate", *axes, "--conditions", str(recordings), "--out", str(out), *options])


def number(pattern, output):
    return float(re.search(pattern, output)[1].replace(",", ""))


@pytest.fixture(scope="module")
def path(recordings, tmp_path_factory):
    path = tmp_path_factory.mktemp("built") / "a.h5"
    assert run_command(recordings, path, *SMALL, "--threads", "2") == 0
    return path


def test_the_stated_error_is_confirmed_at_other_points(path, six_conditions):
    surrogate = Table.open(path)
    assert isinstance(surrogate, Surrogate)
    points = np.random.default_rng(99).uniform(surrogate.lower, surrogate.upper, (1000, 3))
    direct = Simulator(NOMINAL, tuple(axis.name for axis in surrogate.axes), TIGHT)(points, six_conditions)
    difference = surrogate.interpolate(points, "error") - direct
    rms = np.sqrt(np.mean(difference**2, axis=0))
    assert direct.std(axis=0).max() > 50 * rms.max()  # the surrogate explains the variation
    np.testing.assert_allclose(rms, surrogate.error.rms, rtol=0.15)
    assert np.all(np.abs(difference).max(axis=0) < 2 * surrogate.error.worst)
    assert surrogate.error.points == HELD_OUT


@pytest.mark.slow
def test_the_same_seed_gives_the_same_surrogate_on_any_number_of_threads(path, recordings, tmp_path, six_conditions):
    assert run_command(recordings, tmp_path / "b.h5", *SMALL, "--threads", "1") == 0
    assert Table.open(tmp_path / "b.h5").digest == Table.open(path).digest
    first, second = (train_surrogate(HEAVY, {"pressure_bias": (0.8, 1.2)}, conditions=six_conditions, runs=100, steps=1,
                                     seed=seed, progress=False) for seed in (1, 2))
    assert first.digest != second.digest


def test_verify_accepts_a_surrogate(path, capsys):
    assert main(["verify", str(path), "--points", "500"]) == 0
    output, surrogate = capsys.readouterr().out, Table.open(path)
    stated = number(r"held-out points: ([\d.]+) ms RMS", output)
    assert stated == pytest.approx(1e3 * surrogate.error.overall_rms, abs=1e-4)
    assert number(r"error: ([\d.]+) ms RMS", output) == pytest.approx(stated, rel=0.15)
    for part in (surrogate.digest, "kind: surrogate over 3 axes from 1,000 runs;", "pressure_bias: 0.8 to 1.2 of 1.6"):
        assert part in output


@pytest.mark.parametrize(("spans", "options", "message"), [
    (("pressure_bias=0.8:1.2:5",), (),
     r"'pressure_bias=0\.8:1\.2:5' is not a valid axis\. Write NAME=LOW:HIGH,"),
    (("pressure_bias=1.2:0.8",), (), "does not increase"),
    (("pressure_bias=0.8:1.2",) * 2, (), "Give each parameter one --axis"),
    (SPANS, ("--runs", "99"), "Give 100 or more runs"), (SPANS, ("--steps", "0"), "one or more steps"),
    (SPANS, ("--seed", "-1"), "a seed from 0"), (SPANS, ("--threads", "0"), "0 threads are too few"),
])
def test_invalid_options_are_refused_with_a_remedy(recordings, tmp_path, capsys, spans, options, message):
    assert run_command(recordings, tmp_path / "a.h5", *options, spans=spans) == 1
    assert re.search(message, capsys.readouterr().err)
    assert not list(tmp_path.iterdir())


def test_a_box_that_does_not_lock_is_refused_and_the_suggested_one_works(recordings, tmp_path, capsys):
    spans = ("pressure_bias=0.8:6", "friction_coefficient=0.9:1.1")
    assert run_command(recordings, tmp_path / "a.h5", "--runs", "300", "--steps", "1", spans=spans) == 1
    error = capsys.readouterr().err
    assert number(r"([\d,]+) of 1,800 engagements in the box do not lock", error) > 0
    narrower = re.search(r"axis: (pressure_bias=0\.8:[\d.]+) excludes them", error)[1]
    assert 1.5 < float(narrower.split(":")[1]) < 6
    assert not list(tmp_path.iterdir())
    assert run_command(recordings, tmp_path / "a.h5", "--runs", "300", "--steps", "1", spans=(narrower, spans[1])) == 0


def test_recordings_are_not_overwritten(recordings, capsys):
    before = recordings.read_bytes()
    assert run_command(recordings, recordings, *SMALL) == 1
    assert recordings.read_bytes() == before
