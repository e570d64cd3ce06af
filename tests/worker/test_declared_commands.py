"""Commands on a declared machine: build, verify, a surrogate, and a fit of its recorded runs."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from slipstick.black_box import BlackBox
from slipstick.engine.simulation import simulate_runs
from slipstick.machine import list_experiments, open_machine, write_runs
from slipstick.storage.library import Library
from slipstick.storage.shipped import FOLDER
from slipstick.table import Table
from worker.__main__ import main
from worker.simulators import Simulators

AXIS = "--axis", "resistance_value=0.8:1.2:5"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a quick copy of the machine: its experiments end after a tenth of a second."""
    text = (FOLDER / "machines" / "dc_motor.py").read_text()
    (tmp_path / "motor.py").write_text(text.replace("duration=1.0, step=2e-3", "duration=0.1, step=2e-3"))
    return tmp_path


def test_a_table_is_built_verified_and_fitted(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    machine, table, runs = folder / "motor.py", folder / "table.h5", folder / "runs.h5"
    options = "--machine", str(machine)
    assert main(["build", *options, "--out", str(table), "--threads", "1", *AXIS]) == 0
    assert "5 x 9 runs (45 with an output, 0 without an output, 0 failed)" in capsys.readouterr().out
    assert Table.open(table).output.name == "run_up_time"
    assert main(["verify", str(table), *options, "--points", "20"]) == 0
    error = re.search(r"error: (\S+) s RMS", capsys.readouterr().out)
    assert error is not None
    assert float(error[1]) < 1e-5
    (folder / "service").mkdir()
    assert Library(folder / "service").add_table("motor", table.read_bytes())
    declared = open_machine(machine)
    experiments = list_experiments(declared)
    recorded = simulate_runs(declared, experiments.take(np.arange(18) % 9), {"resistance value": 1.08})
    runs.write_bytes(write_runs(recorded, declared))
    settings = folder / "settings.json"
    settings.write_text('{"population": 12, "generations": 8, "intervals": false}')
    assert main(["fit", str(table), str(runs), *options, "--settings", str(settings)]) == 0
    fitted = re.search(r"resistance value (\S+) ohm with a scatter", shown := capsys.readouterr().out)
    assert fitted is not None, shown
    assert float(fitted[1]) == pytest.approx(1.08, abs=0.01)
    for wrong, message in (("--bench=heavy", "--bench is a clutch, and what is simulated is another machine, dc motor"),
                           ("--output=run_up_time", "--output chooses an output of a machine that is simulated")):
        assert main(["fit", str(table), str(runs), *options, wrong]) == 1
        assert message in capsys.readouterr().err
    inputs = "--mean", "1.08", "--std", "0.01", "--output-std", "0.2 ms"
    assert main(["likelihood", str(table), str(runs), *options, *inputs]) == 0
    assert "18 measurements of the run up time" in capsys.readouterr().out
    assert main(["likelihood", str(table), str(runs), *inputs]) == 1
    assert "Give the file that declares the machine as --machine FILE" in capsys.readouterr().err


def test_the_output_is_chosen_by_name(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = "--machine", str(folder / "motor.py")
    build = ["build", *options, "--out", str(folder / "table.h5"), "--threads", "1", *AXIS]
    assert main([*build, "--output", "largest_current"]) == 0
    table = Table.open(folder / "table.h5")
    assert (table.output.name, table.output.unit) == ("largest_current", "A")
    assert main(["verify", str(folder / "table.h5"), *options, "--points", "5"]) == 0
    assert re.search(r"error: \S+ A RMS", capsys.readouterr().out)
    assert main([*build, "--output", "largest_curent"]) == 1
    assert "Did you mean 'largest_current'" in capsys.readouterr().err
    assert main(["build", "--output", "largest_current", "--out", str(folder / "table.h5")]) == 1
    assert "--output is given without --machine" in capsys.readouterr().err
    shutil.copy(FOLDER / "machines" / "dc_motor.py", folder / "motor.py")
    assert main(["verify", str(folder / "table.h5"), *options, "--points", "5"]) == 1
    assert "describes another machine or simulator" in capsys.readouterr().err


def test_a_surrogate_is_trained(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["surrogate", "--machine", str(folder / "motor.py"), "--out", str(folder / "s.h5"), "--threads", "1",
                 "--axis", "resistance_value=0.9:1.1", "--axis", "dry_torque=0.8:1.2", "--runs", "100", "--steps",
                 "200"]) == 0
    assert "surrogate over 2 axes from 100 runs" in capsys.readouterr().out


def test_a_worker_simulates_each_output(folder: Path) -> None:
    files = BlackBox.open_all(folder / "motor.py")
    simulators = Simulators({file.description.digest: file for file in files})
    for file in files:
        simulate = simulators.of_machine(file.description, ["resistance_value"])
        found = simulate(np.array([[1.0], [1.1]]), file.cases)
        assert (np.diff(found, axis=0) < 0).all() == (file.description.output.name == "largest_current")
