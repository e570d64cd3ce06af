"""Declarations of machines: what is refused, what equations read, and the shipped ones with simulated runs."""

import importlib.util
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipstick.engine.equations import Problem
from slipstick.engine.preparation import prepare
from slipstick.engine.trajectory import solve
from slipstick.errors import InvalidValue
from slipstick.machine import Block, Command, Condition, Machine, Parameter, Profile, Quantity, Runs, Sensor
from slipstick.machine.declaration import identifier_of
from slipstick.machine.system import system_of
from slipstick.machine.whole import compose

SHIPPED = sorted((Path(__file__).parents[3] / "tables" / "machines").glob("*.py"))


def load(path: Path) -> Machine:
    spec = importlib.util.spec_from_file_location(f"declared_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    machine: Machine = module.MACHINE
    return machine


def block(name: str = "vessel", **changed: Any) -> Block:
    """A block that a machine takes."""
    declared: dict[str, Any] = {"gives": "level", "reads": ("voltage",), "states": ("level",),
                                "rate_function": lambda x, u, q, p: u.voltage - p.outlet * x.level - q.leak,
                                "parameters": (Parameter("outlet", value=2.0),), "quantities": (Quantity("leak"),)}
    return Block(name, **declared | changed)


def machine(*blocks: Block, **changed: Any) -> Machine:
    declared: dict[str, Any] = {"sensors": (Sensor("level", "m"),), "commands": (Command("voltage", "V"),)}
    return Machine("plant", blocks or (block(),), **declared | changed)


def test_what_fits_is_taken() -> None:
    taken = machine()
    assert taken.block("vessel").gives == "level"
    assert [each.name for each in taken.parameters] == ["outlet"]


def twice(field: str, *members: Any) -> Callable[[], Machine]:
    return lambda: machine(block(**{field: members}))


REFUSED: dict[str, tuple[Callable[[], Machine], str, str]] = {
    "an unknown input": (lambda: machine(block(reads=("voltage", "flow"))),
                         "The block 'vessel' of the machine 'plant' reads 'flow', which is no command",
                         "read one of: level, voltage"),
    "an output without a sensor": (lambda: machine(block(gives="depth")), "gives 'depth', which no sensor measures",
                                   "Declare a Sensor"),
    "states without rates": (lambda: machine(block(rate_function=None)), "block 'vessel' .* has states and no rates",
                             "@block.rate"),
    "neither states nor an output": (lambda: machine(block(states=())), "has neither states nor an output",
                                     "@block.output"),
    "an unknown lowest state": (lambda: machine(block(lowest={"depth": 0.0})), "has no state 'depth'",
                                "Its states are: level"),
    "an unknown switch": (lambda: machine(block(states=("level", "rise"), switches=("speed",))),
                          "has no state 'speed'", "Its states are: level, rise"),
    "states that collide": (lambda: machine(block(states=("level", "a b", "a-b"))),
                            "Among the states of 'vessel', 'a b' and 'a-b' both become 'a_b'", "Rename one"),
    "blocks that collide": (lambda: machine(block(), block()), "Among the blocks, 'vessel' and 'vessel'", "Rename one"),
    "a command like a sensor": (lambda: machine(commands=(Command("voltage"), Command("level"))),
                                "Among the inputs, 'level' and 'level'", "Rename one"),
    "commands that collide": (lambda: machine(commands=(Command("voltage"), Command("the flow"), Command("the.flow"))),
                              "'the flow' and 'the.flow' both become 'the_flow'", "Rename one"),
    "a condition like a command": (lambda: machine(conditions=(Condition("voltage"),)),
                                   "Among the inputs, 'voltage' and 'voltage'", "Rename one"),
    "a signal like a sensor": (lambda: machine(signals={"level": lambda s: s.level}),
                               "Among the inputs, 'level' and 'level'", "Rename one"),
    "a condition like a parameter": (lambda: machine(conditions=(Condition("outlet"),)),
                                     "Among the parameters and conditions, 'outlet' and 'outlet'", "Rename one"),
    "parameters of two values": (lambda: machine(block(), block("basin", parameters=(Parameter("outlet", value=3.0),))),
                                 "Among the parameters and conditions, 'outlet'",
                                 "Rename one of them, or declare a single one for all that have it"),
    "parameters that collide": (twice("parameters", Parameter("a b"), Parameter("a_b")),
                                "'a b' and 'a_b' both become 'a_b'", "Rename one"),
    "quantities of two kinds": (twice("quantities", Quantity("leak"), Quantity("leak", relative=True)),
                                "Among the quantities, 'leak' and 'leak'", "Rename one"),
    "a quantity like the error of a sensor": (twice("quantities", Quantity("level sensor")),
                                              "Among the quantities, 'level sensor' and 'level sensor'", "Rename one"),
    "a keyword as a parameter": (twice("parameters", Parameter("lambda")),
                                 "'lambda' cannot be a name among the parameters and conditions",
                                 "avoid words of Python"),
    "a keyword as a state": (lambda: machine(block(states=("level", "in"))), "'in' cannot be a name among the states",
                             "avoid words of Python"),
    "a keyword as a command": (lambda: machine(commands=(Command("voltage"), Command("class"))),
                               "'class' cannot be a name among the inputs", "avoid words of Python"),
    "a digit first": (twice("quantities", Quantity("2 leaks")),
                      "'2 leaks' cannot be a name among the quantities: '2_leaks' is no", "Begin with a letter"),
    "no name": (twice("parameters", Parameter("")), "'' cannot be a name", "Begin with a letter"),
    "a name in the place of a tuple": (lambda: machine(block(reads="voltage")),
                                       "The block 'vessel' .* has 'voltage' as its reads", "has a comma"),
    "a sensor in the place of a tuple": (lambda: machine(sensors=Sensor("level")),
                                         "has a single Sensor as its sensors", "Write sensors="),
    "a level in the place of a tuple": (lambda: machine(conditions=(Condition("load", levels=2.0),)),  # type: ignore[arg-type]
                                        "The condition 'load' has 2.0 as its levels", "Write levels="),
    "a text as a duration": (lambda: machine(duration="2 s"), "has '2 s' as its duration, which is no number",
                             "without a unit"),
    "a negative scatter": (twice("parameters", Parameter("area", scatter=-0.1)),
                           "The parameter 'area' has -0.1 as its scatter", "Give a number above 0, or 0"),
    "no scale": (twice("parameters", Parameter("area", scale=0.0)), "The parameter 'area' has 0.0 as its scale",
                 "above 0"),
    "a negative noise": (lambda: machine(sensors=(Sensor("level", noise=-1.0),)),
                         "The sensor 'level' has -1.0 as its noise", "Give a number above 0, or 0"),
    "the first value of no signal": (twice("parameters", Parameter("begin", first_of="depth")),
                                     "'begin' is the first value of 'depth', which is no", "Name one of: level"),
    "a profile that goes back": (lambda: machine(commands=(Command("voltage", profiles=(((0, 1), (2, 1), (1, 3)),)),)),
                                 "Profile 0 of the command 'voltage' goes back from 2 s to 1 s", "Sort"),
    "a profile without pairs": (lambda: machine(commands=(Command("voltage", profiles=((0, 1), (2, 1))),)),  # type: ignore[arg-type]
                                "Profile 0 of the command 'voltage' is no tuple of corners", "pairs"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_does_not_fit_is_refused_with_cause_and_remedy(case: str) -> None:
    declare, cause, remedy = REFUSED[case]
    with pytest.raises(InvalidValue, match=cause) as refused:
        declare()
    assert remedy in refused.value.remedy


@pytest.mark.parametrize(("kind", "changed"), [
    ("sensor", {"sensors": (Sensor("level"), Sensor("flow"))}), ("command", {"commands": (Command("flow"),)}),
    ("condition", {"conditions": (Condition("flow"),)}), ("signal", {"signals": {"flow": lambda s: s.level}})])
def test_a_block_may_read_whatever_is_declared(kind: str, changed: dict[str, Any]) -> None:
    assert machine(block(reads=("flow",)), **changed).block("vessel").reads == ("flow",)


def test_what_several_blocks_share_is_listed_once() -> None:
    shared = Parameter("outlet", value=2.0)
    taken = machine(block(), block("basin", parameters=(Parameter("area"), shared), quantities=(
        Quantity("seep"), Quantity("leak"))))
    assert [each.name for each in taken.parameters] == ["outlet", "area"]
    assert [each.name for each in taken.quantities] == ["leak", "seep", "level sensor"]


def test_a_block_may_give_several_signals() -> None:
    both = block(gives=("level", "flow"), output_function=lambda x, u, q, p: (x.level, p.outlet * x.level + q.leak))
    with pytest.raises(InvalidValue, match="gives 'flow', which no sensor measures"):
        machine(both)
    taken = machine(both, sensors=(Sensor("level", "m"), Sensor("flow", "l/s")))
    rng, time = np.random.default_rng(4), np.arange(100) / 10
    command = Profile(np.array([[0.0, 5.0, 9.0]] * 2), np.array([[1.0, 3.0, 0.0]] * 2))
    problem = Problem(system_of(both), 0.1, {"voltage": command.at(time)}, {"leak": 0.5},
                      {"outlet": np.full((2, 1), 2.0)})
    solved = solve(problem)
    exact = solved.x[:, 0]
    np.testing.assert_allclose(solved.outputs, np.stack([exact, 2 * exact + 0.5], axis=1), atol=1e-9)
    runs = Runs(time, {"level": exact + 0.01 * rng.standard_normal(exact.shape),
                       "flow": 2 * exact + 0.1 * rng.standard_normal(exact.shape)}, {"voltage": command})
    part = prepare(taken, runs).parts[0]
    np.testing.assert_array_equal(part.measured, np.stack([runs.signals["level"], runs.signals["flow"]], axis=1))
    assert [noise.std for noise in part.sensors] == [pytest.approx(0.01, rel=0.5), pytest.approx(0.1, rel=0.5)]


def test_quantities_include_the_errors_of_sensors() -> None:
    taken = machine(sensors=(Sensor("level", "m", without=("voltage",)), Sensor("flow", "l/s")))
    assert taken.quantities == (Quantity("leak"), Quantity("level sensor", "m", without=("voltage",)),
                                Quantity("flow sensor", "l/s"))
    assert taken.quantity("flow sensor").unit == "l/s"


@pytest.mark.parametrize(("name", "attribute"), [("level", "level"), ("level 1", "level_1"), ("a-b.c", "a_b_c"),
                                                 ("größe", "größe"), ("x/y z", "x_y_z")])
def test_names_become_identifiers(name: str, attribute: str) -> None:
    assert identifier_of(name) == attribute


def test_equations_read_namespaces_of_identifiers() -> None:
    """A block whose names have spaces, which are attributes of the states, inputs, quantities and parameters."""
    crane = Block("crane", gives="load height", reads=("winch force",), states=("hook speed", "load height"),
                  switches=("hook speed",), lowest={"load height": 0.25},
                  parameters=(Parameter("hook mass", value=2.0), Parameter("dry-friction")),
                  quantities=(Quantity("wind force"),),
                  derived={"hook power": lambda x, u, p: u.winch_force * p.hook_mass})

    @crane.rate
    def accelerate(x, u, q, p):  # type: ignore[no-untyped-def]
        return (u.winch_force + q.wind_force - p.dry_friction * x.hook_speed_side) / p.hook_mass, x.hook_speed

    @crane.start
    def begin(u, q, p):  # type: ignore[no-untyped-def]
        return 0.0, 0.5 * u.winch_force + q.wind_force

    @crane.output
    def read(x, u, q, p):  # type: ignore[no-untyped-def]
        return 10 * x.load_height + q.wind_force

    system = system_of(crane)
    assert set(system.own) >= {"load height", "hook speed", "hook power"}
    assert (system.states, system.switches, system.lowest) == (("hook_speed", "load_height"), (0,), (-np.inf, 0.25))
    time = np.linspace(0, 1, 101)
    solved = solve(Problem(system, 0.01, {"winch_force": np.full((1, 101), 5.0)}, {"wind_force": 1.0}, {
        "hook_mass": np.full((1, 1), 2.0), "dry_friction": np.full((1, 1), 2.0)}))
    np.testing.assert_allclose(solved.x[0], [2 * time, 3.5 + time**2], atol=1e-12)
    np.testing.assert_allclose(solved.outputs[0, 0], 10 * (3.5 + time**2) + 1, atol=1e-12)
    named = system.name((np.full(1, 3.0), np.ones(1)), {0: np.array([1.0])})
    assert (named.hook_speed, named.load_height, named.hook_speed_side) == (3, 1, 1)
    assert system.own["hook power"](None, named_as(winch_force=3.0), named_as(hook_mass=4.0)) == 12
    assert system.own["hook speed"](named, None, None) == 3


def named_as(**values: float) -> Any:
    return type("Named", (), values)


def test_without_start_and_output_states_are_0_and_the_first_one_is_given() -> None:
    plain = block(gives="inflow", states=("level", "sum"),
                  rate_function=lambda x, u, q, p: (u.voltage - x.level, x.level))
    system = system_of(plain)
    solved = solve(Problem(system, 0.1, {"voltage": np.ones((2, 11))}, {}, {}))
    assert system.signals == ("inflow",)
    np.testing.assert_array_equal(solved.x[:, :, 0], 0)
    np.testing.assert_array_equal(solved.outputs[:, 0], solved.x[:, 0])
    np.testing.assert_array_equal(system.own["inflow"](named_as(level=4.0), None, None), 4)
    assert [*system.own] == ["level", "sum", "inflow"]


def test_without_an_output_the_states_with_the_names_of_the_signals_are_given() -> None:
    """A lag before the measured state is written first as often as behind it."""
    lagged = block(gives="level 1", states=("inflow", "level_1"),
                   rate_function=lambda x, u, q, p: (u.voltage - x.inflow, x.inflow))
    both = block(gives=("flow", "level"), states=("level", "flow"),
                 rate_function=lambda x, u, q, p: (x.flow, u.voltage - x.flow))
    given = {"voltage": np.ones((2, 11))}
    solved = solve(Problem(system_of(lagged), 0.1, given, {}, {}))
    np.testing.assert_array_equal(solved.outputs[:, 0], solved.x[:, 1])
    solved = solve(Problem(system_of(both), 0.1, given, {}, {}))
    np.testing.assert_array_equal(solved.outputs, solved.x[:, ::-1])
    whole = compose(machine(both, sensors=(Sensor("flow"), Sensor("level")))).blocks[0]
    solved = solve(Problem(system_of(whole), 0.1, given, {}, {}))
    np.testing.assert_array_equal(solved.outputs, solved.x[:, ::-1])
    with pytest.raises(InvalidValue, match="gives several signals that are not all states, and has no output"):
        machine(block(gives=("level", "flow")), sensors=(Sensor("level"), Sensor("flow")))


def test_a_state_that_is_called_like_a_side_is_refused() -> None:
    with pytest.raises(InvalidValue, match="level side"):
        machine(block(states=("level", "level side"), switches=("level",)))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_machines_load(path: Path) -> None:
    shipped = load(path)
    assert identifier_of(shipped.name) == path.stem
    assert [each.signal for each in shipped.sensors] == [
        signal for each in shipped.blocks for signal in each.signals]
    assert all(each.value is not None or each.first_of is not None for each in shipped.parameters)


RUNS = 6
TANK_NOISE, CURRENT_NOISE, SPEED_NOISE = 2e-3, 3e-3, 0.1


def drive(rng: np.random.Generator, corners: np.ndarray, low: float, high: float) -> Profile:
    return Profile(np.tile(corners, (RUNS, 1)), rng.uniform(low, high, (RUNS, len(corners))))


@cache
def run_tanks() -> tuple[Runs, dict[str, np.ndarray]]:
    """Two tanks by Heun's method with small steps; the recorded runs, and their signals without noise."""
    rng, fine, step = np.random.default_rng(1), 10, 0.1
    time = np.arange(0, 400 * fine + 1) * step / fine
    voltage = drive(rng, np.linspace(0, 40, 9), 3.0, 9.0)
    command = voltage.at(time).T

    def rates(levels: np.ndarray, applied: np.ndarray) -> np.ndarray:
        first, second = np.maximum(levels, 0)
        between = 8e-3 * np.sqrt(first) + 0.02 * np.maximum(first - 0.6, 0) ** 1.5
        return np.array([(0.92e-3 * applied - between) / 0.05, (between - 9e-3 * np.sqrt(second)) / 0.06])

    levels, kept = rng.uniform(0.1, 0.4, (2, RUNS)), []
    for j in range(len(time)):
        kept.append(levels)
        if j + 1 < len(time):
            first = rates(levels, command[j])
            levels = levels + step / fine / 2 * (first + rates(levels + step / fine * first, command[j + 1]))
    exact = dict(zip(("level 1", "level 2"), np.array(kept[::fine]).transpose(1, 2, 0), strict=True))
    measured = {name: value + TANK_NOISE * rng.standard_normal(value.shape) for name, value in exact.items()}
    return Runs(time[::fine], measured, {"voltage": voltage}), exact


@cache
def run_motor() -> tuple[Runs, dict[str, np.ndarray]]:
    """A motor with rest by Euler's method with small steps."""
    rng, fine, step = np.random.default_rng(2), 40, 2e-3
    time = np.arange(0, 300 * fine + 1) * step / fine
    voltage, load = drive(rng, np.linspace(0, 0.6, 7), -8.0, 8.0), np.repeat([0.005, 0.01], RUNS // 2)
    command = voltage.at(time).T
    current, speed, kept, small = np.zeros(RUNS), np.zeros(RUNS), [], step / fine
    for j in range(len(time)):
        kept.append((current, speed))
        torque, dry = 0.05 * current - 5e-5 * speed, 0.015 + load
        moving = speed + small * (torque - np.sign(speed) * dry) / 1e-4
        moving = np.where(speed == 0, small * np.sign(torque) * np.maximum(np.abs(torque) - dry, 0) / 1e-4,
                          np.where(moving * speed < 0, 0, moving))
        current, speed = current + small * (command[j] - current - 0.05 * speed) / 3e-3, moving
    exact = dict(zip(("current", "speed"), np.array(kept[::fine]).transpose(1, 2, 0), strict=True))
    measured = {name: value + noise * rng.standard_normal(value.shape) for (name, value), noise in zip(
        exact.items(), (CURRENT_NOISE, SPEED_NOISE), strict=True)}
    return Runs(time[::fine], measured, {"voltage": voltage}, {"load torque": load}), exact


SIMULATED = {"two_tanks": (run_tanks, {"level 1": TANK_NOISE, "level 2": TANK_NOISE}),
             "dc_motor": (run_motor, {"current": CURRENT_NOISE, "speed": SPEED_NOISE})}
simulated = pytest.mark.parametrize("name", SIMULATED)


def shipped(name: str) -> Machine:
    return load(next(path for path in SHIPPED if path.stem == name))


@simulated
def test_blocks_of_shipped_machines_follow_simulated_runs(name: str) -> None:
    """At nominal parameters, driven by what was measured of the other blocks."""
    (runs, exact), noise = SIMULATED[name][0](), SIMULATED[name][1]
    taken = shipped(name)
    recorded = prepare(taken, runs)
    assert [part.name for part in recorded.parts] == [each.name for each in taken.blocks]
    for part in recorded.parts:
        signal = part.block.gives
        assert part.sensors[0].std == pytest.approx(noise[signal], rel=0.4)
        assert part.counted.all()
        np.testing.assert_array_equal(part.measured[:, 0], runs.signals[signal])
        assert set(part.parameters) == {identifier_of(each.name) for each in part.block.parameters} | (
            {"load_torque"} & {identifier_of(each) for each in part.block.reads})
        assert all(value.shape == (RUNS, 1) for value in part.parameters.values())
        assert all(value.shape == (RUNS, part.fine * (len(runs.time) - 1) + 1) for value in part.inputs.values())
        problem = Problem(part.system, part.step, part.inputs, part.quantities, part.parameters)
        off = solve(problem).outputs[:, 0, ::part.fine] - exact[signal]
        assert np.sqrt(np.mean(off**2)) < 3 * noise[signal]
        assert np.ptp(exact[signal]) > 200 * noise[signal]


@simulated
def test_quantities_of_shipped_machines_act_on_their_blocks(name: str) -> None:
    recorded = prepare(shipped(name), SIMULATED[name][0]()[0])
    for part in recorded.parts:
        problem = Problem(part.system, part.step, part.inputs, part.quantities, part.parameters)
        solved = solve(problem)
        basis = np.ones((RUNS, 1, part.fine * (len(recorded.runs.time) - 1) + 1))
        for quantity in part.block.quantities:
            response = solved.respond(solved.direction("quantity", identifier_of(quantity.name), quantity.size), basis)
            assert np.isfinite(response).all()
            assert np.abs(response * quantity.size).max() > part.sensors[0].std, quantity.name


def test_parameters_are_as_declared_as_stated_or_the_first_value_of_a_signal() -> None:
    runs, _ = run_tanks()
    recorded = prepare(shipped("two_tanks"), runs, {"area 1": 0.07})
    first = recorded.parts[0].parameters
    np.testing.assert_array_equal(first["area_1"], 0.07)
    np.testing.assert_array_equal(first["outlet_1"], 8e-3)
    np.testing.assert_array_equal(first["start_1"], runs.signals["level 1"][:, :1])
    assert {term.name for term in recorded.random} == {each.name for each in recorded.machine.parameters}
    assert {term.name for term in recorded.shared} == {
        "clock of level 1 in tank 1", "clock of level_1 in tank 2", "clock of level 2 in tank 2"}
    sizes = {term.name: term.size for term in recorded.random}
    assert (sizes["area 1"], sizes["start 1"], sizes["outlet 1"]) == (pytest.approx(0.07), 0.01, pytest.approx(8e-3))


def test_a_stated_condition_is_a_parameter_with_errors_of_its_levels() -> None:
    recorded = prepare(shipped("dc_motor"), run_motor()[0])
    winding, shaft = recorded.parts
    np.testing.assert_array_equal(shaft.parameters["load_torque"][:, 0], np.repeat([0.005, 0.01], RUNS // 2))
    assert "load_torque" not in winding.parameters
    assert "load_torque" not in shaft.inputs
    errors = [term for term in recorded.shared if term.place == "load_torque"]
    assert [term.std for term in errors] == [0.02] * len(errors)
    np.testing.assert_allclose(sum(term.values for term in errors), np.repeat([0.005, 0.01], RUNS // 2))


def test_a_block_without_its_signals_is_left_out() -> None:
    runs, _ = run_tanks()
    for kept, names in ((("level 1",), ["tank 1"]), (("level 2",), [])):
        recorded = prepare(shipped("two_tanks"), replace(runs, signals={name: runs.signals[name] for name in kept}))
        assert [part.name for part in recorded.parts] == names


def test_a_parameter_without_a_value_is_refused() -> None:
    taken = machine(block(parameters=(Parameter("outlet"),)))
    runs = Runs(np.arange(50.0), {"level": np.random.default_rng(3).standard_normal((2, 50))},
                {"voltage": Profile(np.zeros((2, 1)), np.ones((2, 1)))})
    with pytest.raises(InvalidValue, match="The parameter 'outlet' of the machine 'plant' has no value") as refused:
        prepare(taken, runs)
    assert "State it" in refused.value.remedy
    assert prepare(taken, runs, {"outlet": 2.0}).parts[0].parameters["outlet"].tolist() == [[2.0], [2.0]]
