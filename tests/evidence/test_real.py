"""Real recordings: files of others are read as they are described, on made-up ones, and the page is as the table."""

import csv
import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy

from evidence import __main__ as evidence
from evidence import pages
from evidence.real import command, emps, pneumatic_seals, sum_terms
from evidence.real.measured import Expected, plot_law, state_law
from slipstick.engine.evidence import multiply, screen
from slipstick.engine.laws import list_candidates
from slipstick.engine.recordings import Recorded
from slipstick.engine.settings import EngineSettings
from slipstick.engine.settling import settle
from slipstick.engine.simulation import simulate
from slipstick.engine.study import estimate_parameters
from slipstick.machine import Profile

FEWEST = 30
"""Candidates that each machine is asked for, at least."""


def count_candidates(recorded: Recorded) -> int:
    fits = settle(recorded, EngineSettings())
    return len(list_candidates(recorded, {name: model.own() for fit in fits for name, model in fit.models.items()}))


@pytest.fixture(scope="module")
def positioning(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray, np.ndarray]:
    """Two recordings of a carriage with friction that the plain model lacks, their positions and voltages."""
    folder, rng = tmp_path_factory.mktemp("emps"), np.random.default_rng(1)
    instants = 1e-3 * np.arange(6000)
    voltage = 2 * np.sign(np.sin(5 * instants + np.array([[0.0], [1.0]])))
    profile = Profile(np.tile(instants, (2, 1)), 35 * voltage)
    values = {"mass": 95.0, "viscous friction": 200.0, "Coulomb friction": 20.0, "offset": 0.0, "start": 0.1,
              "start velocity": 0.0}
    position = simulate(emps.declare(is_dry=True), instants, {"force": profile}, values, fine=1)["position"]
    position += 1e-7 * rng.standard_normal(position.shape)
    for row, (name, more) in enumerate((("DATA_EMPS", {}), ("DATA_EMPS_PULSES", {"pulses_N": np.ones((6000, 1))}))):
        scipy.io.savemat(folder / f"{name}.mat", {"qm": position[row][:, None], "vir": voltage[row][:, None],
                                                  "gtau": 35.0, **more})
    return folder, position, voltage


def test_positioning_system_is_cut_into_runs_of_both_recordings(
        positioning: tuple[Path, np.ndarray, np.ndarray]) -> None:
    folder, position, voltage = positioning
    read = emps.read(folder)
    assert [*read] == [emps.PLAIN, emps.DRY]
    runs = read[emps.PLAIN].runs
    assert len(runs) == 10  # each third one of 28
    last = slice(10 + 13 * 414, 10 + 14 * 414)
    np.testing.assert_array_equal(runs.signals["position"][-1], position[1, last][::2])
    np.testing.assert_allclose(runs.commands["force"].value[-1, :-1], 35 * voltage[1, last])  # pulses are in it already
    np.testing.assert_allclose(runs.commands["force"].time[0, 0], 0.5e-3)


def test_positioning_system_is_asked_for_many_laws(positioning: tuple[Path, np.ndarray, np.ndarray]) -> None:
    assert count_candidates(emps.read(positioning[0])[emps.DRY]) >= FEWEST


@pytest.mark.slow
def test_a_law_and_parameters_that_replace_each_other_are_known_in_their_sum(
        positioning: tuple[Path, np.ndarray, np.ndarray]) -> None:
    [bare] = settle(emps.read(positioning[0])[emps.PLAIN], EngineSettings())
    pair, velocity = ("friction force", "velocity"), np.array([-0.1, -0.05, 0.05, 0.1])
    candidate, = (each for each in list_candidates(bare.recorded, {"drive": bare.models["drive"].own()})
                  if each.pair == pair)
    screened, = screen(bare, [candidate], multiply(bare.models, [candidate]))
    fitted = bare.beside({pair: candidate}, {pair: screened.prior})

    value, std = sum_terms(fitted, pair, velocity, {"viscous friction": velocity, "offset": np.ones(4)})
    viscous, = (each for each in estimate_parameters(fitted) if each.name == "viscous friction")

    np.testing.assert_allclose(value, 200 * velocity + 20 * np.sign(velocity), atol=4)
    assert (std < 0.5 * viscous.error * np.abs(velocity)).any()
    np.testing.assert_allclose(sum_terms(fitted, ("none", ""), velocity, {"viscous friction": velocity})[1],
                               viscous.error * np.abs(velocity), rtol=1e-6)

    law = Expected(pair, (0.02, 0.06, 0.1), "k v", lambda v, k: k * v)
    changes = sum_terms(fitted, pair, np.array(law.places), {})[0]
    [panel], rows = plot_law(law, fitted), {row.what: row for row in state_law(law, fitted)}
    assert rows["friction force at velocity 0.1"].value == pytest.approx(changes[2] - changes[0])
    assert rows["k of k v"].value == pytest.approx((changes[2] - changes[0]) / 0.08, rel=0.2)
    [measured], [published] = panel.measured, panel.published
    np.testing.assert_allclose(np.interp(law.places, measured.x, measured.value), changes - changes[0], atol=1e-9)
    assert len(measured.x) > len(published.x) == 3
    [stepped] = plot_law(replace(law, is_stepped=True), fitted)
    np.testing.assert_array_equal(stepped.measured[0].x, law.places)
    assert not [*plot_law(replace(law, pair=("none", "")), fitted)]


@pytest.fixture(scope="module")
def piston(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of a seal at two pressures, with friction of 2 N and 1 N/bar."""
    folder, rng = tmp_path_factory.mktemp("seals"), np.random.default_rng(1)
    for pressure in (1.0, 5.0):
        time = np.cumsum(rng.uniform(9, 12, 5000))
        position = 20 - 18 * np.cos(2e-3 * np.pi * time / 8)
        read = pressure + 0.02 * np.sin(time / 700) + 1e-3 * rng.standard_normal(5000)
        side = np.sign(np.sin(2e-3 * np.pi * time / 8))
        force = 49.09 * (pressure + 0.02 * np.sin(time / 700)) + (2 + pressure) * side
        rows = np.stack([time, position + 0.01 * rng.standard_normal(5000), read,
                         force + 0.03 * rng.standard_normal(5000)], axis=1)
        with gzip.open(folder / f"NAPN_{pressure:.0f}bar.csv.gz", "wt") as file:
            np.savetxt(file, rows, "%.3f", ",", header="time [ms],position [mm],pressure [bar],force [N]", comments="")
    return folder


def test_seals_are_read_as_means_over_even_times(piston: Path) -> None:
    recorded = pneumatic_seals.read(piston)
    assert [*recorded] == ["NAPN"]
    runs = recorded["NAPN"].runs
    assert runs.step == pytest.approx(0.1)
    assert set(runs.channels["set pressure"]) == {1.0, 5.0}
    velocity, position = (runs.commands[name].value for name in ("velocity", "position"))
    np.testing.assert_allclose(velocity[:, 1:-1], np.gradient(position, 0.1, axis=1)[:, 1:-1], atol=1e-9)
    assert pneumatic_seals.measure_loops(runs) == pytest.approx({1.0: 3.0, 5.0: 7.0}, abs=0.1)
    assert count_candidates(recorded["NAPN"]) >= FEWEST


def test_a_pause_of_the_recording_is_in_no_run(piston: Path, tmp_path: Path) -> None:
    [name, _] = sorted(piston.iterdir())
    with gzip.open(name, "rt") as file:
        lines = file.readlines()
    with gzip.open(tmp_path / name.name, "wt") as file:
        file.writelines([*lines[:3000], *lines[3200:]])
    whole, cut = (pneumatic_seals.read_runs([path]) for path in (name, tmp_path / name.name))
    assert len(cut) < len(whole)


@pytest.mark.slow
def test_the_command_answers_the_machines_that_it_names(piston: Path, tmp_path: Path,
                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "TABLE", tmp_path / "real.csv")
    monkeypatch.setattr(command, "PICTURES", tmp_path)
    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / "pneumatic_seals").symlink_to(piston)
    assert evidence.main(["real", str(folder), "pneumatic_seals"]) == 0
    with (tmp_path / "real.csv").open() as file:
        rows = [*csv.DictReader(file)]
    named = [row["what"] for row in rows if row["what"].startswith("named")]
    assert any("friction by pressure over velocity" in words for words in named)
    stated = {row["what"]: row for row in rows}
    for level in (1, 5):
        assert float(stated[f"friction at {level} bar"]["value"]) == pytest.approx(2 + level, abs=0.3)
    assert (tmp_path / "pneumatic_seals.svg").read_text().startswith("<svg")


def test_a_machine_that_there_is_not_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        evidence.main(["real", str(tmp_path), "clock"])
    assert "clock is none of emps" in capsys.readouterr().err


@pytest.mark.parametrize("name", command.MACHINES)
def test_each_machine_has_rows_the_picture_that_it_draws_and_is_short(name: str) -> None:
    with command.TABLE.open() as file:
        rows = [row for row in csv.DictReader(file) if row["machine"] == name]
    assert all(int(row["value"]) >= FEWEST for row in rows if row["what"] == "candidates")
    assert rows
    if hasattr(command.load(name), "draw"):
        assert (command.PICTURES / f"{name}.svg").exists()
        assert f"real/{name}.svg" in (pages.ROOT / "evidence" / "real.md").read_text()
    assert len((command.PICTURES / f"{name}.py").read_text().splitlines()) <= 120
