"""Whole machines against scipy, with laws, and what cannot be composed or simulated."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from slipstick.engine.bases import Kind, past
from slipstick.engine.measured_law import Law
from slipstick.engine.simulation import simulate
from slipstick.errors import InvalidValue
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Sensor, open_machine
from slipstick.machine.declaration import Namespace
from slipstick.machine.whole import compose, sort_blocks

TANKS = open_machine(Path(__file__).parents[3] / "tables" / "machines" / "two_tanks.py")
TIME = np.linspace(0, 80, 161)
CORNERS, VOLTS = np.array([0.0, 20, 25, 50, 80]), np.array([[3.0, 9, 4, 8, 2], [8.0, 2, 6, 9, 9], [2.0, 2, 9, 9, 4]])
COMMANDS = {"voltage": Profile(np.tile(CORNERS, (3, 1)), VOLTS)}
START = {"start 1": np.array([0.3, 0.5, 0.1]), "start 2": np.array([0.2, 0.4, 0.05])}


def law(pair: tuple[str, str], x: np.ndarray, change: np.ndarray, kind: Kind = "own") -> Law:
    return Law(pair, kind, "", "", x, change, np.zeros((len(x), len(x))), 0)


Leak = Callable[[float, float, float, float], float]


def integrate_tanks(leak: Leak, gain: float = 0.92e-3) -> dict[str, np.ndarray]:
    """Levels by scipy, with a leak in m^3/s of the second tank over both levels, time and voltage."""
    levels = np.empty((2, 3, len(TIME)))
    for i, volts in enumerate(VOLTS):
        def rate(t: float, x: np.ndarray, volts: np.ndarray = volts) -> list[float]:
            between = 8e-3 * np.sqrt(max(x[0], 0)) + 0.02 * max(x[0] - 0.6, 0) ** 1.5
            voltage = float(np.interp(t, CORNERS, volts))
            return [(gain * voltage - between) / 0.05,
                    (between - 9e-3 * np.sqrt(max(x[1], 0)) - leak(x[0], x[1], t, voltage)) / 0.06]

        here = np.array([START["start 1"][i], START["start 2"][i]])
        for low, high in pairwise(CORNERS):
            inside = (low <= TIME) & (high >= TIME)
            solved = solve_ivp(rate, (low, high), here, "RK45", TIME[inside], rtol=1e-10, atol=1e-12, max_step=0.25)
            levels[:, i, inside] = solved.y
            here = solved.y[:, -1]
    return {"level 1": levels[0], "level 2": levels[1]}


KNOTS = np.array([0.1, 0.3, 0.6, 0.9])
LEAKS = np.array([0.0, 4e-4, 1e-4, 6e-4])


def test_two_tanks_are_those_of_scipy() -> None:
    simulated, exact = simulate(TANKS, TIME, COMMANDS, START), integrate_tanks(lambda *_: 0.0)
    assert set(simulated) == set(exact)
    for name, level in exact.items():
        np.testing.assert_allclose(simulated[name], level, atol=1e-6)


def test_a_ramp_of_a_command_may_be_shorter_than_a_step() -> None:
    """The lag of a ramp, in closed form, and the command itself beside it."""
    lag, width, time = 0.05, 2e-3, np.linspace(0, 1, 101)
    block = Block("valve", gives=("flow", "demand"), reads=("voltage",), states=("flow",))
    block.rate(lambda x, u, q, p: (u.voltage - x.flow) / lag)
    block.output(lambda x, u, q, p: (x.flow, u.voltage))
    machine = Machine("valve", (block,), (Sensor("flow", ""), Sensor("demand", "")), commands=(Command("voltage", ""),))
    begin = np.random.default_rng(1).uniform(0.1, 0.8, (20, 1))
    corners = np.concatenate([0 * begin, begin, begin + width, 0 * begin + 1], axis=1)
    profile = Profile(corners, np.tile([0.0, 0.0, 1.0, 1.0], (20, 1)))

    def follow(since: np.ndarray) -> np.ndarray:
        return np.where(since > 0, since - lag * -np.expm1(-np.maximum(since, 0) / lag), 0) / width

    simulated, since = simulate(machine, time, {"voltage": profile}, {}), time - begin
    off = np.abs(simulated["flow"] - (follow(since) - follow(since - width)))
    assert off.max() < 3e-3  # 6.5e-3 where rates read the command at the steps
    assert off[since > 0.02].max() < 2e-5  # 3.2e-3
    np.testing.assert_array_equal(simulated["demand"], profile.at(time))


def test_values_are_taken_of_all_runs_or_of_each() -> None:
    exact = integrate_tanks(lambda *_: 0.0, gain=1.1e-3)
    for gain in (1.1e-3, np.full(3, 1.1e-3)):
        simulated = simulate(TANKS, TIME, COMMANDS, {**START, "pump gain": gain})
        np.testing.assert_allclose(simulated["level 2"], exact["level 2"], atol=1e-6)


@pytest.mark.parametrize("on", ["level 1", "level 2", "time", "temperature", "voltage"])
def test_laws_are_those_of_scipy(on: str) -> None:
    """Over what another block gives, over an own level, over time, a constant of the runs, and a command."""
    x = {"time": 80 * KNOTS, "voltage": 10 * KNOTS}.get(on, KNOTS)
    values = START | ({"temperature": np.full(3, 0.2)} if on == "temperature" else {})
    kinds: dict[str, Kind] = {"time": "curve", "voltage": "curve", "temperature": "between"}
    taken = law(("leak 2", on), x, LEAKS, kinds.get(on, "own"))
    exact = integrate_tanks(lambda first, second, time, volts: float(np.interp(
        {"level 1": first, "level 2": second, "time": time, "temperature": 0.2, "voltage": volts}[on],
        x, LEAKS)))["level 2"]
    plain = simulate(TANKS, TIME, COMMANDS, values)["level 2"]
    simulated = simulate(TANKS, TIME, COMMANDS, values, [taken])["level 2"]
    np.testing.assert_allclose(simulated, exact, atol=3e-5)  # a law bends within a step
    assert np.abs(simulated - plain).max() > 0.01


def test_a_law_over_the_past_does_not_depend_on_the_steps() -> None:
    variable = past("voltage", "V", COMMANDS["voltage"].at(TIME), 1)
    change = np.random.default_rng(1).standard_normal(len(variable.knots)) * 3e-3
    taken = replace(law(("pump flow", "past voltage"), variable.knots, change, "past"), period=TIME[1] - TIME[0])
    signals = [simulate(TANKS, TIME, COMMANDS, START, [taken], fine)["level 1"] for fine in (1, 2, 4)]
    plain = simulate(TANKS, TIME, COMMANDS, START)["level 1"]
    reach = np.abs(signals[0] - plain).max()
    for each in signals[1:]:
        np.testing.assert_allclose(each, signals[0], atol=0.02 * reach)


def test_errors_of_sensors_change_nothing_of_the_machine() -> None:
    taken = law(("level 1 sensor", "level 1"), KNOTS, 0.1 * np.ones(4))
    np.testing.assert_array_equal(simulate(TANKS, TIME, COMMANDS, START, [taken])["level 2"],
                                  simulate(TANKS, TIME, COMMANDS, START)["level 2"])


def test_what_a_simulation_lacks_is_named() -> None:
    with pytest.raises(InvalidValue, match="'gain' of the machine 'plant' has no value"):
        simulate(plant(passing("a", "command", parameters=(Parameter("gain"),))), TIME, {}, {})
    with pytest.raises(InvalidValue, match="The law of 'leak 2' depends on 'temperature'"):
        simulate(TANKS, TIME, COMMANDS, START, [law(("leak 2", "temperature"), KNOTS, LEAKS, "between")])


def passing(name: str, *reads: str, **declared: object) -> Block:
    block = Block(name, gives=name, reads=reads, **declared)  # type: ignore[arg-type]
    block.output(lambda x, u, q, p: sum(getattr(u, each) for each in reads))
    return block


def plant(*blocks: Block) -> Machine:
    return Machine("plant", blocks, tuple(Sensor(signal) for block in blocks for signal in block.signals),
                   commands=(Command("command"),))


def test_an_algebraic_loop_is_refused_with_its_signals() -> None:
    with pytest.raises(InvalidValue, match="The signals 'a', 'b' form an algebraic loop") as refused:
        compose(plant(passing("a", "command", "b"), passing("b", "a"), passing("c", "command")))
    assert "state" in refused.value.remedy


def test_blocks_come_behind_those_that_they_read() -> None:
    blocks = passing("a", "b"), passing("b", "c"), passing("c", "command")
    assert [block.name for block in sort_blocks(blocks)] == ["c", "b", "a"]
    taken = simulate(plant(*blocks), np.arange(5.0), {"command": Profile(np.array([[0.0, 4]]), np.array([[1.0, 5]]))},
                     {})
    for signal in "abc":
        np.testing.assert_allclose(taken[signal], [[1, 2, 3, 4, 5]])


def test_a_loop_through_a_state_is_none() -> None:
    store = Block("store", gives="b", reads=("a",), states=("b",), parameters=(Parameter("time", value=2.0),),
                  rate_function=lambda x, u, q, p: (u.a - x.b) / p.time)
    fed = Block("fed", gives="a", reads=("command", "b"), quantities=(Quantity("fault"),),
                output_function=lambda x, u, q, p: u.command - u.b + q.fault)
    time = np.linspace(0, 4, 41)
    taken = simulate(plant(store, fed), time, {"command": Profile(np.zeros((1, 1)), np.ones((1, 1)))}, {})
    np.testing.assert_allclose(taken["b"][0], 0.5 * (1 - np.exp(-time)), atol=1e-8)
    np.testing.assert_allclose(taken["a"][0], 1 - taken["b"][0], atol=1e-12)


def test_a_further_own_variable_of_a_whole_reads_what_another_block_gives() -> None:
    store = Block("store", gives="b", reads=("a",), states=("b",), parameters=(Parameter("time", value=2.0),),
                  rate_function=lambda x, u, q, p: (u.a - x.b) / p.time, derived={"excess": lambda x, u, p: u.a - x.b})
    fed = Block("fed", gives="a", reads=("command", "b"), quantities=(Quantity("fault"),),
                output_function=lambda x, u, q, p: u.command - u.b + q.fault)
    excess = compose(plant(store, fed)).blocks[0].derived["excess"]
    assert excess(Namespace(b=0.25), Namespace(command=1.0), Namespace(time=2.0)) == 0.5


@pytest.mark.parametrize("first", ["controller", "drum"])
def test_a_loop_is_none_where_an_output_does_not_read_what_its_rates_read(first: str) -> None:
    controller = Block("controller", gives="torque", reads=("command", "speed"), states=("integral",),
                       rate_function=lambda x, u, q, p: u.command - u.speed,
                       output_function=lambda x, u, q, p: x.integral + 2 * (u.command - u.speed))
    drum = Block("drum", gives=("speed", "angle"), reads=("torque",), states=("turns", "momentum"),
                 parameters=(Parameter("inertia", value=1.0),), quantities=(Quantity("loss"),),
                 rate_function=lambda x, u, q, p: (x.momentum / p.inertia, u.torque - q.loss),
                 output_function=lambda x, u, q, p: (x.momentum / p.inertia, 2 * np.pi * x.turns))
    time = np.linspace(0, 4, 81)
    blocks = (controller, drum) if first == "controller" else (drum, controller)
    taken = simulate(plant(*blocks), time, {"command": Profile(np.zeros((1, 1)), np.ones((1, 1)))}, {})
    np.testing.assert_allclose(taken["speed"][0], 1 - np.exp(-time) * (1 - time), atol=1e-6)
    np.testing.assert_allclose(taken["torque"][0], np.exp(-time) * (2 - time), atol=1e-6)
    joined = compose(plant(*blocks))
    loop = plant(*joined.blocks, passing("c", "speed"))
    assert [block.name for block in sort_blocks(loop.blocks)] == ["whole", "c"]


def test_states_of_one_name_in_two_blocks_are_refused() -> None:
    blocks = [Block(name, gives=name, states=("x",), rate_function=lambda x, u, q, p: -x.x) for name in "ab"]
    with pytest.raises(InvalidValue, match="Two blocks of the machine 'plant' have a state 'x'"):
        compose(plant(*blocks))


def test_a_whole_is_composed_of_what_its_blocks_have() -> None:
    whole = compose(TANKS).blocks[0]
    assert whole.signals == ("level 1", "level 2")
    assert whole.reads == ("voltage",)
    assert dict(whole.lowest) == {"level 1": 0.0, "level 2": 0.0}
    assert whole.parameters == TANKS.parameters
    assert set(compose(TANKS).quantities) == set(TANKS.quantities)
    swapped = simulate(replace(TANKS, blocks=tuple(reversed(TANKS.blocks))), TIME, COMMANDS, START)["level 2"]
    np.testing.assert_allclose(swapped, simulate(TANKS, TIME, COMMANDS, START)["level 2"], atol=1e-9)


def test_a_block_of_several_signals_gives_them_in_the_whole() -> None:
    both = Block("both", gives=("a", "b"), reads=("command",), states=("store",),
                 rate_function=lambda x, u, q, p: u.command - x.store,
                 output_function=lambda x, u, q, p: (x.store, 2 * x.store))
    time = np.linspace(0, 4, 41)
    taken = simulate(plant(both), time, {"command": Profile(np.zeros((1, 1)), np.ones((1, 1)))}, {})
    np.testing.assert_allclose(taken["b"], 2 * taken["a"])
