"""A declared machine as simulator: its description, runs at many points at once, and its recorded runs."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slipstick
from slipstick.black_box import BlackBox, Measurements, Workers, measure_runs
from slipstick.black_box.declared import Declared, open_once
from slipstick.engine import simulation
from slipstick.errors import BadMachine, BadRecording, InvalidValue, SlipstickError, UnknownName
from slipstick.interface.build import build
from slipstick.machine import Profile, evaluate_output, list_experiments, open_machine
from slipstick.storage.shipped import FOLDER

LAG = '''
from slipstick.machine import Block, Command, Condition, Machine, Output, Parameter, Sensor

lag = Block("lag", gives="level", reads=("drive", "Load"), states=("level",),
            parameters=(Parameter("Time constant", "s", value=0.5, scatter=0.3), Parameter("gain", value=2.0),
                        Parameter("offset", "m", value=0.0), Parameter("start", "m", value=0.1, scale=0.01)))


@lag.rate
def rate(x, u, q, p):
    return (p.gain * u.drive + p.offset + p.Load - x.level) / p.Time_constant


@lag.start
def start(u, q, p):
    return p.start


MACHINE = Machine("lag", (lag,), (Sensor("level", "m", noise=1e-3),),
                  commands=(Command("drive", "m", profiles=(((0, 1),), ((0, 0.2),))),),
                  conditions=(Condition("Load", "m", levels=(0.0, 0.1)),), duration=2.0, step=0.01,
                  outputs=(Output("rise time", "s", of="level", above=1.0),
                           Output("end", "m", of="level"), Output("mean", "m", of="level", take="mean")))
'''

OUTPUTS = LAG[LAG.index("outputs="):LAG.rindex(")")]


@pytest.fixture
def lag(tmp_path: Path) -> Path:
    (tmp_path / "lag.py").write_text(LAG)
    return tmp_path / "lag.py"


def test_the_description_is_what_the_machine_declares(lag: Path) -> None:
    file = BlackBox.open(lag)
    constant, gain = file.description.inputs  # a change of the others is additive
    assert (constant.name, constant.unit, constant.nominal) == ("time_constant", "s", 0.5)
    assert (gain.name, gain.unit, gain.nominal, gain.lower, gain.upper) == ("gain", "1", 2.0, 0.5, 1.5)
    np.testing.assert_allclose([constant.lower, constant.upper], [np.exp(-1.2), np.exp(1.2)])
    assert [(each.name, each.unit) for each in file.cases.quantities] == [("drive_profile", "1"), ("load", "m")]
    assert file.cases.values.tolist() == [[0, 0], [0, 0.1], [1, 0], [1, 0.1]]
    assert [each.description.output.name for each in BlackBox.open_all(lag)] == ["rise_time", "end", "mean"]


@pytest.mark.parametrize("given", ["duration=2.0, step=0.01,\n                  ", OUTPUTS,
                                   ", profiles=(((0, 1),), ((0, 0.2),))", ", levels=(0.0, 0.1)"])
def test_a_machine_that_is_not_simulated_has_no_simulators_but_can_have_runs(lag: Path, given: str) -> None:
    assert given in LAG
    lag.write_text(LAG.replace(given, ""))
    assert BlackBox.open_all(lag) == []
    assert open_once(lag).name == "lag"


def test_a_command_with_a_single_profile_has_no_column_beside_others(lag: Path) -> None:
    single = LAG.replace(" ((0, 0.2),)", "")
    lag.write_text(single)
    assert [each.name for each in BlackBox.open(lag).cases.quantities] == ["load"]
    lag.write_text(single.replace('(Condition("Load", "m", levels=(0.0, 0.1)),)', "()").replace(' "Load"),', '),')
                   .replace("p.Load", "0"))
    assert [each.name for each in BlackBox.open(lag).cases.quantities] == ["drive_profile"]


def test_a_shipped_machine_is_opened_by_its_name() -> None:
    file = slipstick.BlackBox.open("dc_motor")
    assert [each.name for each in file.description.inputs] == [
        "resistance_value", "inductance", "motor_constant", "rotor_inertia", "viscous_coefficient", "dry_torque"]
    assert len(file.cases) == 9
    assert [each.name for each in slipstick.BlackBox.open("two_tanks").cases.quantities] == ["voltage_profile"]


@pytest.mark.parametrize(("before", "after", "error", "message"), [
    ("value=2.0", "within=2.0", InvalidValue, "The parameter 'gain' of the machine 'lag' has no nominal value"),
    ("duration=2.0, ", "", InvalidValue, "it has no duration"),
    ("outputs=(", "signals={}, **{} or dict(outputs=()), inputs_=(", BadMachine, "lag.py, line"),
    ("gain *", "gain /* ", BadMachine, "lag.py, line 11"),
    ("gain", "load", InvalidValue, "stands for more than one thing"),
])
def test_what_a_file_lacks_is_said(lag: Path, before: str, after: str, error: type[SlipstickError],
                                   message: str) -> None:
    assert before in LAG
    lag.write_text(LAG.replace(before, after))
    with pytest.raises(error, match=message):
        BlackBox.open(lag)


def test_names_that_do_not_exist_are_refused(lag: Path) -> None:
    with pytest.raises(UnknownName, match=r"no output 'rise'. Did you mean 'rise_time'"):
        BlackBox.open(lag, "rise")
    with pytest.raises(UnknownName, match="Did you mean 'dc_motor'"):
        BlackBox.open("dc_moter")
    with pytest.raises(UnknownName, match=r"Did you mean 'lag.py'"):
        BlackBox.open(lag.with_name("lug.py"))


def test_the_identity_is_that_of_the_declaration_and_the_output(lag: Path) -> None:
    own, end = (each.simulator.identity for each in BlackBox.open_all(lag)[:2])
    assert own != end
    lag.write_text(LAG.replace("@lag.start", "# as recorded\n@lag.start"))
    assert BlackBox.open(lag).simulator.identity == own
    lag.write_text(LAG.replace("p.offset +", "p.offset -"))
    assert BlackBox.open(lag).simulator.identity != own


def test_outputs_are_those_of_the_equations(lag: Path) -> None:
    file = BlackBox.open(lag)
    assert isinstance(file.simulator, Declared)
    constants, gains = np.array([0.5, 0.4, 0.6]), np.array([2.0, 3.0, 1.0])
    found = file.simulator.evaluate({"time_constant": constants, "gain": gains}, file.cases.take([0, 2]))
    with np.errstate(invalid="ignore", divide="ignore"):
        expected = constants * np.log((gains - 0.1) / (gains - 1))
    np.testing.assert_allclose(found[:2, 0], expected[:2], rtol=1e-4)
    assert np.isnan(found[2, 0])  # it approaches 1 from below
    assert np.isnan(found[:, 1]).all()
    end = BlackBox.open(lag, "end").simulator
    assert isinstance(end, Declared)
    level = 0.5 + (0.1 - 0.5) * np.exp(-2.0 / 0.5)
    np.testing.assert_allclose(end.run({"time_constant": 0.5, "gain": 2.0}, file.cases.take([3])), [level], rtol=1e-6)
    with pytest.raises(InvalidValue, match="There is no profile 2 in the column drive_profile"):
        end.evaluate({"time_constant": constants, "gain": gains},
                     replace(file.cases, values=np.array([[2.0, 0.0]])))


def test_equations_that_fail_are_named(lag: Path) -> None:
    lag.write_text(LAG.replace("x.level)", "x.hight)"))
    with pytest.raises(BadMachine, match=r"line 11: the block declares no x\.hight. Known: level"):
        BlackBox.open(lag)
    text = "p.gain * u.drive"  # only one of the commands' profiles is that small
    lag.write_text(LAG.replace(text, f"{text} / (1 if np.min(u.drive) > 0.5 else None)").replace(
        "\nfrom", "\nimport numpy as np\nfrom", 1))
    with pytest.raises(InvalidValue, match="equations of the machine 'lag' fail: TypeError"):
        build(BlackBox.open(lag), {"gain": (0.8, 1.2, 3)}, progress=False)


def test_a_build_simulates_many_runs_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = list[int]()
    own = simulation.simulate

    def counted(machine: Any, time: np.ndarray, commands: Any, *rest: Any, **named: Any) -> Any:
        calls.append(len(next(iter(commands.values())).time))
        return own(machine, time, commands, *rest, **named)

    monkeypatch.setattr(simulation, "simulate", counted)
    with ThreadPoolExecutor(1) as executor:
        table = build(BlackBox.open("dc_motor"), {"resistance_value": (0.8, 1.2, 9), "dry_torque": (0.5, 1.5, 9)},
                      executor=executor, progress=False)
    assert calls[0] == 1  # the trial at the nominal values
    assert len(calls[1:]) <= 3
    assert sum(calls[1:]) == table.times.size == 9 * 9 * 9
    machine = open_machine("dc_motor")
    planned = list_experiments(machine)
    direct = own(machine, planned.time, planned.commands,
                 {**planned.conditions, "resistance value": 0.85, "dry torque": 0.015 * 1.25})
    np.testing.assert_allclose(table.times[1, 6], evaluate_output(machine.outputs[0], planned.time, direct), rtol=1e-9)


def test_runs_of_one_call_start_no_process(lag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slipstick.black_box.simulation.start_processes", lambda count: 1 / 0)
    file = BlackBox.open(lag)
    table = build(file, {"gain": (0.8, 1.2, 3)}, threads=8, progress=False)
    with Workers(file, 8) as workers:
        outputs, _ = workers.simulate(("gain",), np.linspace(0.8, 1.2, 3)[:, None], file.cases)
    np.testing.assert_array_equal(outputs, table.times)
    with Workers(file, 8) as workers, pytest.raises(ZeroDivisionError):  # more runs than those of one call
        workers.simulate(("gain",), np.ones((file.simulator.most_runs, 1)), file.cases)


# Recorded runs.


def test_recorded_runs_are_measurements(lag: Path) -> None:
    machine, file = open_machine(lag), BlackBox.open(lag)
    runs = simulation.simulate_runs(machine, list_experiments(machine), {"gain": 2.1}, seed=1)
    measured = measure_runs(runs, file)
    assert isinstance(measured, Measurements)
    assert measured.output == file.description.output
    order = [tuple(row) for row in measured.conditions.values.tolist()]
    assert sorted(order) == [(0, 0), (0, 0.1)]
    assert "2 of 4 runs have no rise_time and are left out: " in measured.description
    reached = np.isfinite(evaluate_output(machine.outputs[0], runs.time, runs.signals))
    np.testing.assert_array_equal(
        measured.measured_time, evaluate_output(machine.outputs[0], runs.time, runs.signals)[reached])
    everywhere = measure_runs(runs, BlackBox.open(lag, "end"))
    assert (len(everywhere), everywhere.description) == (4, runs.description)
    shifted = replace(runs, commands={"drive": Profile(
        runs.commands["drive"].time, runs.commands["drive"].value * 1.03)})  # a supply that is 3 % off
    assert measure_runs(shifted, file).conditions.digest == measured.conditions.digest


def test_runs_that_begin_elsewhere_than_the_experiments_are_refused() -> None:
    machine, file = open_machine("two_tanks"), BlackBox.open("two_tanks")
    runs = simulation.simulate_runs(machine, list_experiments(machine), seed=1)
    assert len(measure_runs(runs, file))
    higher = runs.signals["level 2"].copy()
    higher[3] += 0.1
    with pytest.raises(BadRecording, match=r"Run 3 begins with a level 2 of 0.15\d* m, and .* with 0.05 m"):
        measure_runs(replace(runs, signals={**runs.signals, "level 2": higher}), file)


def test_runs_of_something_else_are_refused(lag: Path) -> None:
    machine, file = open_machine(lag), BlackBox.open(lag)
    runs = simulation.simulate_runs(machine, list_experiments(machine))
    value = runs.commands["drive"].value.copy()
    value[2] = 0.5
    with pytest.raises(BadRecording, match=r"'drive' of run 2 follows no profile .* profile 1, the nearest, by 0.3 m"):
        measure_runs(replace(runs, commands={"drive": Profile(runs.commands["drive"].time, value)}), file)
    with pytest.raises(BadRecording, match="lack the condition 'Load'"):
        measure_runs(replace(runs, conditions={}), file)
    with pytest.raises(BadRecording, match="None of the 2 runs has the output rise_time"):
        measure_runs(runs.take(np.array([2, 3])), file)
    nearly = replace(runs, time=runs.time[:-2], signals={"level": runs.signals["level"][:, :-2]})
    assert len(measure_runs(nearly, BlackBox.open(lag, "mean")))  # a clock that is not even loses a sample at each end
    short = replace(runs, time=runs.time[:50], signals={"level": runs.signals["level"][:, :50]})
    with pytest.raises(BadRecording, match=r"take 0.49 s, and experiments of the machine 'lag' 2 s"):
        measure_runs(short, BlackBox.open(lag, "mean"))
    with pytest.raises(InvalidValue, match="is no declared machine"):
        measure_runs(runs, BlackBox.open(FOLDER.parent / "docs" / "motor.toml"))
