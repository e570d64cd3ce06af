import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from slipstick.clutch.ensemble import shifting_times
from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, UnknownName
from slipstick.interface.build import build
from slipstick.interface.models import read_model
from slipstick.table import Table
from tests.benches import COMPACT, HEAVY, NOMINAL
from worker.__main__ import main
from worker.build import read_axes

ROOT = Path(__file__).parents[2]

@pytest.mark.slow
def test_a_repeatedly_killed_build_gives_the_same_table(tmp_path):
    out, axes = tmp_path / "a.h5", ("pressure_bias=0.5:1.5:30", "initial_position=0.5:1.5:30")
    command = [sys.executable, "-m", "worker", "build", "--threads", "1", "--out", out, "--axis", axes[0],
               "--axis", axes[1]]
    for count in (2, 5):
        with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL) as worker:
            while worker.poll() is None and len(list(tmp_path.glob(".*.parts/*.npz"))) < count:
                time.sleep(0.002)
            worker.send_signal(signal.SIGKILL)
        assert not out.exists()
    completed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert "from an earlier run" in completed.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]
    assert Table.open(out).digest == build(HEAVY, read_axes(axes, "NAME=LOW:HIGH:COUNT")).digest


def test_the_command_reads_a_model_and_conditions(tmp_path, capsys):
    model = NOMINAL.with_parameters({"gear_ratio": 3.0}).with_effect("quadratic_load_drag", {})
    (tmp_path / "calibrated.json").write_text(json.dumps({"model": model.spec(), "chi_square": 1.0}))
    (tmp_path / "bench.csv").write_text(
        "current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m]\n2,140,10,50\n5,110,6,20\n")
    assert main(["build", "--axis", "gear_ratio=0.9:1.1:3", "--model", str(tmp_path / "calibrated.json"),
                 "--conditions", str(tmp_path / "bench.csv"), "--out", str(tmp_path / "a.h5")]) == 0
    table = Table.open(tmp_path / "a.h5")
    assert table.model == model
    assert (table.axes[0].nominal, table.times.shape) == (3.0, (3, 2))
    assert table.conditions.motor_speed.tolist() == [140, 110]
    assert table.digest in capsys.readouterr().out


def test_a_table_of_another_bench(tmp_path, capsys):
    axis, out = ["--axis", "pressure_bias=0.9:1.1:3"], ["--out", str(tmp_path / "a.h5")]
    compact = ["--bench", str(ROOT / "tables" / "compact.toml")]
    assert main(["build", *compact, *axis, *out]) == 0
    table = Table.open(tmp_path / "a.h5")
    assert table.model == Model(COMPACT.physics)
    assert table.conditions.digest == COMPACT.conditions.digest
    expected, _ = shifting_times(Model(COMPACT.physics), COMPACT.conditions)
    np.testing.assert_array_equal(table.times[1], expected[0])
    (tmp_path / "heavy.json").write_text(json.dumps(NOMINAL.spec()))
    capsys.readouterr()
    assert main(["build", *compact, "--model", str(tmp_path / "heavy.json"), *axis, *out]) == 1
    assert "made for another bench than 'compact'" in capsys.readouterr().err


@pytest.mark.parametrize(("arguments", "message"), [
    (["--bench", "tables/heavi.toml"], "Did you mean 'heavy.toml'"), (["--bench", "README.md"], "is not TOML"),
    (["--axis", "presure_bias=0.5:1.5:5"], "Did you mean 'pressure_bias'"),
    (["--axis", "pressure_bias=0.5:1.5"], "Write NAME=LOW:HIGH:COUNT"),
    (["--axis", "pressure_bias=1.5:0.5:5"], "does not increase"),
    (["--axis", "pressure_bias=0.5:1.5:1"], "has 1 point"), (["--axis", "pressure_bias=0.5:1.5:-3"], "has -3 point"),
    (["--threads", "0"], "0 threads"),
    (["--model", "missing.json"], "Cannot read a model"),
    (["--conditions", "missing.csv"], "recordings file 'missing.csv'"),
])
def test_invalid_options_are_refused_with_a_remedy(arguments, message, tmp_path, capsys):
    assert main(["build", "--out", str(tmp_path / "a.h5"), *arguments]) == 1
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_invalid_model_files_are_refused(tmp_path):
    path = tmp_path / "model.json"
    for content in ("[]", "{", "{}", '{"model": 3}', json.dumps({**NOMINAL.spec(), "bench": {}}),
                    json.dumps({**NOMINAL.spec(), "bench": {**NOMINAL.spec()["bench"], "digest": "0" * 64}})):
        path.write_text(content)
        with pytest.raises(InvalidValue):
            read_model(path)
    path.write_text(json.dumps({**NOMINAL.spec(), "effects": {"gravity": {"g": 9.81}}}))
    with pytest.raises(UnknownName):
        read_model(path)


def test_builds_that_cannot_succeed_are_refused_before_the_simulation(tmp_path: Path) -> None:
    recordings = tmp_path / "measured.h5"
    recordings.write_bytes((Path(__file__).parents[2] / "tables" / "measured.h5").read_bytes())
    content = recordings.read_bytes()
    axis = ("--axis", "pressure_bias=0.9:1.1:2")
    for arguments in ((*axis, *axis), ("--axis", "pressure_bias=0.5:1.5:100000", "--axis", "ramp_share=0.5:1:100000"),
                      (*axis, "--out", str(recordings))):
        out = () if "--out" in arguments else ("--out", str(tmp_path / "new.h5"))
        assert main(["build", *arguments, *out]) == 1
    assert recordings.read_bytes() == content
    assert [path.name for path in tmp_path.iterdir()] == ["measured.h5"]


def test_a_table_of_a_model_with_a_measured_law_has_another_digest(tmp_path, capsys):
    law = MeasuredLaw("load torque", "output speed", (0.0, 20.0, 60.0), (0.0, 2.0, 30.0), relative=False)
    tables = []
    for name, model in (("with", NOMINAL.with_law(law)), ("without", NOMINAL)):
        (tmp_path / f"{name}.json").write_text(json.dumps(model.spec()))
        arguments = ["--model", str(tmp_path / f"{name}.json"), "--out", str(tmp_path / f"{name}.h5")]
        assert main(["build", *arguments, "--axis", "pressure_bias=0.9:1.1:2", "--threads", "1"]) == 0
        tables.append(Table.open(tmp_path / f"{name}.h5"))
        expected = shifting_times(model, HEAVY.conditions, ["pressure_bias"], np.array([[0.9], [1.1]]))[0]
        np.testing.assert_array_equal(tables[-1].times, expected)
    assert tables[0].model == NOMINAL.with_law(law)
    assert tables[0].digest != tables[1].digest
    assert not np.array_equal(tables[0].times, tables[1].times)
    capsys.readouterr()
    assert main(["verify", str(tmp_path / "with.h5"), "--points", "0"]) == 0
    assert "measured law: load torque over output speed" in capsys.readouterr().out
