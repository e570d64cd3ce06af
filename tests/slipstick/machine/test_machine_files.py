"""Files of machines and of runs, and the experiments that a machine declares."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from slipstick.engine.simulation import simulate_runs
from slipstick.errors import BadMachine, BadRecording, InvalidValue, UnknownName
from slipstick.machine import (
    Block,
    Command,
    Condition,
    Machine,
    Output,
    Quantity,
    Sensor,
    evaluate_output,
    list_experiments,
    open_machine,
    read_runs,
    require_runs,
    write_runs,
)
from slipstick.machine.experiments import find_time
from slipstick.storage.shipped import FOLDER


@pytest.mark.parametrize("name", ["dc_motor", "two_tanks"])
def test_the_experiments_of_a_shipped_machine_are_recorded_and_read_back(name: str, tmp_path: Path) -> None:
    machine = open_machine(name)
    runs = simulate_runs(machine, list_experiments(machine), seed=3)
    path = tmp_path / "runs.h5"
    path.write_bytes(write_runs(runs, machine))
    again = require_runs(machine, read_runs(path))
    assert again.digest == runs.digest
    assert (again.machine, again.units) == (machine.name, runs.units)
    for output in machine.outputs:
        assert np.isfinite(evaluate_output(output, runs.time, runs.signals)).all(), output.name


def test_runs_keep_their_names_and_need_none(tmp_path: Path) -> None:
    machine = open_machine("dc_motor")
    runs = simulate_runs(machine, list_experiments(machine))
    assert read_runs(write_runs(runs)).names == ()
    named = replace(runs, names=tuple(f"Prüfstand {place}.mf4" for place in range(len(runs))))
    again = read_runs(named.save(tmp_path / "runs.h5"))
    assert (again.names, again.digest) == (named.names, runs.digest)
    assert again.take(np.array([4, 2])).names == ("Prüfstand 4.mf4", "Prüfstand 2.mf4")
    assert again.take(slice(1)).names == ("Prüfstand 0.mf4",)
    for names, cause in ((np.array([b"a", b"b"]), "does not have 9 texts"), (np.arange(9.0), "does not have 9 texts"),
                         (np.array([b"\xff"] * len(runs)), "damaged")):
        with h5py.File(tmp_path / "runs.h5", "r+") as file:
            del file["names"]
            file["names"] = names
        with pytest.raises(BadRecording, match=cause):
            read_runs(tmp_path / "runs.h5")


def test_experiments_combine_profiles_and_levels_and_scatter_only_with_a_seed() -> None:
    machine = open_machine("dc_motor")
    experiments = list_experiments(machine)
    pairs = set(zip(experiments.numbers["voltage"], experiments.conditions["load torque"], strict=True))
    assert len(pairs) == len(experiments) == 9
    bare, again = simulate_runs(machine, experiments), simulate_runs(machine, experiments)
    np.testing.assert_array_equal(bare.signals["speed"], again.signals["speed"])
    assert np.abs(simulate_runs(machine, experiments, seed=1).signals["speed"] - bare.signals["speed"]).max() > 1


def test_a_machine_without_commands_has_an_experiment_for_each_level() -> None:
    decay = Block("decay", gives="level", reads=("begin",), states=("level",), quantities=(Quantity("loss"),),
                  rate_function=lambda x, u, q, p: -x.level - q.loss, start_function=lambda u, q, p: p.begin)
    machine = Machine("decay", (decay,), (Sensor("level"),), conditions=(Condition("begin", levels=(1.0, 2.0, 3.0)),),
                      duration=1.0, step=0.1)
    runs = simulate_runs(machine, list_experiments(machine))
    np.testing.assert_allclose(runs.signals["level"][:, -1], np.exp(-1) * np.array([1, 2, 3]), rtol=1e-6)


@pytest.mark.parametrize(("change", "cause"), [
    ({"duration": 0.0}, "no duration"), ({"step": 3.0}, "at most half"),
    ({"commands": (Command("voltage", "V"),)}, "'voltage' has no profile")])
def test_a_machine_without_experiments_says_what_is_missing(change: dict[str, object], cause: str) -> None:
    with pytest.raises(InvalidValue, match=cause):
        list_experiments(replace(open_machine("dc_motor"), **change))  # type: ignore[arg-type]


@pytest.mark.parametrize(("output", "cause"), [
    (Output("a", "s", of="torque"), "no sensor measures"), (Output("a", "s", "speed", 1.0, 2.0), "two levels"),
    (Output("a", "s", "speed", take="median"), "'median'")])
def test_an_output_that_cannot_be_computed_is_refused(output: Output, cause: str) -> None:
    with pytest.raises(InvalidValue, match=cause):
        replace(open_machine("dc_motor"), outputs=(output,))


@pytest.mark.parametrize(("signal", "rising", "expected"), [
    ([0.0, 1.0, 3.0, 0.0], True, 1.5), ([3.0, 1.0, 3.0], True, 1.5), ([3.0, 1.0, 3.0], False, 0.5),
    ([0.0, 1.0, 1.9], True, np.nan), ([2.0, 2.0, 2.0], True, np.nan)])
def test_times_are_those_of_the_first_crossing_in_a_direction(signal: list[float], rising: bool,
                                                              expected: float) -> None:
    at = find_time(10 + np.arange(float(len(signal))), np.array([signal]), 2.0, rising)
    np.testing.assert_allclose(at, [10 + expected])


@pytest.mark.parametrize(("text", "cause"), [
    ("x = 1", "declares no MACHINE"), ("x = 1\nx +", "line 2: invalid syntax"), ("\n\n1 / 0", "line 3: ZeroDivision"),
    ("from slipstick.machine import Machine\nMACHINE = Machine('a b', (), ())\nMACHINE.quantity('x')", "line 3")])
def test_a_file_that_declares_no_machine_is_refused_with_its_line(tmp_path: Path, text: str, cause: str) -> None:
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(BadMachine, match=f"mine.py.*{cause}"):
        open_machine(path)


EQUATIONS = """import numpy as np
from slipstick.machine import Block, Command, Condition, Machine, Parameter, Quantity, Sensor
cart = Block("cart", gives="speed", reads=("pull", "load"), states=("speed",), switches=("speed",),
             parameters=(Parameter("dry force", "N", value=2.0),), quantities=(Quantity("lost force", "N"),))


@cart.rate
def roll(x, u, q, p):
    force = u.pull - p.load - q.lost_force
    return force - p.dry_force * x.speed_side


MACHINE = Machine("cart", (cart,), (Sensor("speed", "m/s"),), (Command("pull", "N"),), (Condition("load", "N"),))
"""


@pytest.mark.parametrize(("part", "instead", "cause"), [
    ("", "", None),
    ("u.pull", "u.pul", "line 9: the block declares no u.pul. Did you mean 'pull'"),
    ("p.load", "u.load", "the block declares no u.load. It is read as p.load"),
    ("q.lost_force", "q.lost", "the block declares no q.lost. Known: lost_force"),
    ("(x, u, q, p)", "(x, u, p)", r"Declare the function with the arguments \(x, u, q, p\)"),
    ("    return force", "    force", "no array for each of: speed"),
    ("x.speed_side", "x.speed_side, x.speed", "returns 2 values instead of 1"),
    ("u.pull -", "(u.pull if u.pull > 0 else 0) -", "line 9: `if`.*numpy.where"),
    ("x.speed_side", "np.sign(x.speed)", "do not read x.speed_side"),
    (', switches=("speed",)', "", r"x.speed_side is read, and 'speed' is not among the switches of the block. "
                                  r"Declare switches=\('speed',\)")])
def test_equations_that_fail_are_refused_with_block_and_line(tmp_path: Path, part: str, instead: str,
                                                             cause: str | None) -> None:
    path = tmp_path / "mine.py"
    assert part in EQUATIONS
    path.write_text(EQUATIONS.replace(part, instead, 1) if part else EQUATIONS)
    if cause is None:
        assert open_machine(path).name == "cart"
        return
    with pytest.raises(BadMachine, match=f"mine.py: The rates of the block 'cart' of the machine 'cart'.*{cause}"):
        open_machine(path)


def test_a_bench_is_no_machine_and_none_of_its_lines_is_called_wrong() -> None:
    with pytest.raises(BadMachine, match=r"^heavy\.toml is no Python file, and declares no machine\. Give the file"):
        open_machine(FOLDER / "heavy.toml")


def test_a_start_that_reads_a_simulated_signal_is_refused_with_the_parameter_to_declare(tmp_path: Path) -> None:
    path, start = tmp_path / "mine.py", "@cart.start\ndef begin(u, q, p):\n    return u.{}\n\n\nMACHINE"
    text = EQUATIONS.replace('reads=("pull", ', 'reads=("pull", "speed", ')
    path.write_text(text.replace("MACHINE", start.format("pull")))
    assert open_machine(path).name == "cart"
    path.write_text(text.replace("MACHINE", start.format("speed")))
    with pytest.raises(BadMachine, match=r"The start of the block 'cart' .* reads u\.speed") as refused:
        open_machine(path)
    assert "first_of='speed'" in refused.value.remedy


def test_a_machine_that_does_not_exist_is_answered_with_those_that_do(tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="two_tanks"):
        open_machine(tmp_path / "two_tank.py")


def test_a_file_of_a_machine_may_import_its_neighbours(tmp_path: Path) -> None:
    (tmp_path / "numbers_of_mine.py").write_text("GAIN = 2.0\n")
    (tmp_path / "mine.py").write_text(
        "import numbers_of_mine\nfrom slipstick.machine import *\nfrom slipstick.machine import Machine\n"
        "b = Block('b', gives='y', reads=('c',), output_function=lambda x, u, q, p: numbers_of_mine.GAIN * u.c)\n"
        "MACHINE = Machine('gain', (b,), (Sensor('y'),), (Command('c', profiles=(((0, 0), (1, 1)),)),),"
        " duration=1.0, step=0.25)\n")
    machine = open_machine(tmp_path / "mine.py")
    runs = simulate_runs(machine, list_experiments(machine))
    np.testing.assert_allclose(runs.signals["y"], [[0, 0.5, 1, 1.5, 2]])


def test_runs_that_are_not_of_a_machine_are_refused(tmp_path: Path) -> None:
    machine = open_machine("dc_motor")
    runs = simulate_runs(machine, list_experiments(machine))
    with pytest.raises(BadRecording, match="lack the signal 'speed'"):
        require_runs(machine, replace(runs, signals={"current": runs.signals["current"]}))
    with pytest.raises(BadRecording, match="'speed' is in 'rpm'"):
        require_runs(machine, replace(runs, units={**runs.units, "speed": "rpm"}))


@pytest.mark.parametrize("damage", ["time", "signals/speed", "commands/voltage/value"])
def test_damaged_runs_are_refused(damage: str, tmp_path: Path) -> None:
    machine = open_machine("dc_motor")
    path = tmp_path / "runs.h5"
    path.write_bytes(write_runs(simulate_runs(machine, list_experiments(machine)), machine))
    with h5py.File(path, "r+") as file:
        file[damage][...] = np.nan
    with pytest.raises(BadRecording):
        read_runs(path)
