"""The other machines: equations, rest, strength of effects, determinism and files."""

import ast
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from evidence.answer import Answer, NamedPair
from evidence.generator.forms import Curve, Lag
from evidence.generator.machines import tanks
from evidence.generator.machines.draw import MachineCase, draw_machine_case
from evidence.generator.machines.effects import CONSTANT_IN_A_RUN
from evidence.generator.machines.files import truth_file, write_machine_case
from evidence.generator.machines.pairs import ABSCISSAS, EQUAL_PAIRS, PAIRS, accept_pairs
from evidence.generator.machines.recordings import MACHINES, measure, simulate
from evidence.generator.machines.runs import Change, Runs, prepare_inputs
from evidence.generator.machines.settings import draw_nominal, draw_values, vary
from evidence.generator.machines.strength import Scale
from evidence.generator.machines.world import TEMPTATIONS, Spike, World, draw_world
from evidence.generator.truth import Truth
from evidence.judge import judge

pytestmark = pytest.mark.slow  # what draws the cases of the evidence is no part of the product

FOLDER = Path(__file__).parents[2] / "evidence" / "generator"
LINE = Curve("line", np.array([0.0, 1.0]), np.array([0.0, 1.0]))
CONSTANT = Curve("constant", np.array([0.0, 1.0]), np.ones(2))
SEEDS = (0, 6, 10, 14, 1, 7, 15)
"""More of the tanks, which take less time; four have no effect."""


@cache
def case_of(seed: int) -> MachineCase:
    return draw_machine_case(seed)


@cache
def nominal_runs(machine: str, seed: int = 1) -> Runs:
    random = np.random.default_rng(seed)
    return draw_nominal(machine, draw_values(machine, random), random)[0]


def quiet_world(machine: str, runs: Runs) -> World:
    reading = simulate(runs, MACHINES[machine].COARSE)
    ranges = {name: float(np.ptp(rows)) for name, rows in reading.signals.items()}
    return draw_world(machine, ranges, tuple(runs.values), np.random.default_rng(0))


@pytest.mark.parametrize("path", sorted((FOLDER / "machines").glob("*.py")), ids=lambda path: path.name)
def test_it_imports_nothing_but_the_generator(path: Path) -> None:
    own = {each.stem for each in FOLDER.glob("*.py")}
    for node in ast.walk(ast.parse(path.read_text())):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom):
            assert node.level <= 2
            if node.level == 2:
                assert {node.module} <= own or {alias.name for alias in node.names} <= own
            names = [] if node.level else [node.module or ""]
        for name in names:
            assert name.split(".")[0] in {"numpy", "scipy", "h5py", *sys.stdlib_module_names}, name


def test_levels_agree_with_another_integration() -> None:
    runs = nominal_runs("two tanks").take(np.array([3]))
    change = Change(("leak 1", "level 1"), "leak 1", "level 1", LINE, 0.0, 1.0)
    leaking = runs.with_change(change, np.array([5e-4]))
    p = {name: float(column[0]) for name, column in runs.values.items()}
    corners = leaking.corner_time[0], leaking.corner_value[0]

    def balance(t: float, volume: np.ndarray) -> list[float]:
        height = [volume[0] / p["area 1"], volume[1] / p["area 2"]]
        over = max(height[0] - 0.6, 0.0)
        passes = p["outlet 1"] * height[0] ** 0.5 + 0.02 * over**1.5
        leak = 5e-4 * min(max(height[0], 0.0), 1.0)
        return [p["pump gain"] * np.interp(t, *corners) - passes - leak, passes - p["outlet 2"] * height[1] ** 0.5]

    start = [float(runs.conditions[f"start level {tank}"][0]) * p[f"area {tank}"] for tank in (1, 2)]
    solved = solve_ivp(balance, (0.0, runs.time[-1]), start, "DOP853", runs.time, rtol=1e-10, atol=1e-13, max_step=0.5)
    signals = simulate(leaking).signals
    assert signals["level 1"].max() > tanks.BRIM + 0.02
    for tank in (1, 2):
        assert np.abs(signals[f"level {tank}"][0] - solved.y[tank - 1] / p[f"area {tank}"]).max() < 2e-6
    assert np.abs(signals["level 1"] - simulate(runs, tanks.COARSE).signals["level 1"]).max() > 0.01


def test_tanks_without_an_outlet_keep_what_is_pumped() -> None:
    runs = replace(nominal_runs("two tanks"), count=100).times_factors({"outlet 2": 0.0})
    inputs = prepare_inputs(runs, tanks.FINE)
    levels = tanks.integrate(runs, inputs)
    volume = sum(levels[f"level {tank}"] * runs.values[f"area {tank}"][:, None] for tank in (1, 2))
    pumped = np.trapezoid(inputs.commanded, dx=inputs.step, axis=0) * runs.values["pump gain"]
    np.testing.assert_allclose(volume[:, -1] - volume[:, 0], pumped, rtol=1e-10)


def integrate_motor(p: dict[str, float], load: float, voltage: Callable[[float], float], time: np.ndarray,
                    corners: np.ndarray) -> np.ndarray:
    """Return current and speed (2, k) by pieces of smooth motion between corners, rests and reversals."""
    signals, state, begin, sense = np.zeros((2, len(time))), np.zeros(2), 0.0, 0
    hold = p["dry torque"] + load

    def torque(current: float) -> float:
        return p["motor constant"] * current * 0.9  # the torque constant is too low by a tenth

    def rates(t: float, y: np.ndarray) -> list[float]:
        voltages = voltage(t) - p["resistance value"] * y[0] - 0.9 * p["motor constant"] * y[1]
        drag = sense * hold + p["viscous coefficient"] * y[1]
        return [voltages / p["inductance"], (torque(y[0]) - drag) / p["rotor inertia"] if sense else 0.0]

    def stops(t: float, y: np.ndarray) -> float:
        return float(sense * y[1]) if sense else 1.0

    def starts(t: float, y: np.ndarray) -> float:
        return 1.0 if sense else hold - abs(torque(y[0]))

    stops.terminal = starts.terminal = True
    stops.direction = starts.direction = -1
    while begin < time[-1]:
        later = corners[corners > begin + 1e-12]
        end = min(float(later[0]) if len(later) else time[-1], time[-1])
        part = solve_ivp(rates, (begin, end), state, "DOP853", rtol=1e-10, atol=1e-10, events=(stops, starts),
                         dense_output=True, max_step=1e-3)
        inside = (time >= begin) & (time <= part.t[-1])
        signals[:, inside] = part.sol(time[inside])
        begin, state = part.t[-1], part.y[:, -1]
        if part.status == 1:
            state[1] = 0.0
            sense = int(np.sign(state[0])) if abs(torque(state[0])) >= hold * (1 - 1e-12) else 0
    return signals


def test_current_and_speed_agree_with_another_integration() -> None:
    runs = nominal_runs("dc motor", 2)
    lane = int(np.argmax(runs.conditions["load torque"]))
    runs = runs.take(np.array([lane]))
    weak = runs.with_change(Change(("torque constant", "time"), "torque constant", "time", CONSTANT), np.array([-0.1]))
    p = {name: float(column[0]) for name, column in runs.values.items()}
    corners = weak.corner_time[0], weak.corner_value[0]
    solved = integrate_motor(p, float(runs.conditions["load torque"][0]), lambda t: float(np.interp(t, *corners)),
                             runs.time, corners[0])
    signals = simulate(weak).signals
    speed = signals["speed"][0]
    assert np.sum(np.diff(np.sign(speed)) != 0) > 3
    assert 0.02 < np.mean(speed == 0) < 0.9
    for name, reference in zip(("current", "speed"), solved, strict=True):
        assert np.abs(signals[name][0] - reference).max() < 1e-6 * np.ptp(reference), name


def test_a_rotor_rests_until_the_torque_of_the_current_exceeds_what_holds_it() -> None:
    runs = nominal_runs("dc motor", 3).take(np.arange(3))
    p = {name: column[0] for name, column in runs.values.items()}
    enough = (p["dry torque"] + 0.03) * p["resistance value"] / p["motor constant"]
    ramp = np.tile([0.0, 0.1, 10.0], (3, 1))
    still = replace(runs, count=200, conditions={"load torque": np.full(3, 0.03)}, corner_time=ramp,
                    corner_value=enough * np.array([[0.0, 0.99, 0.99], [0.0, 1.01, 1.01], [0.0, -1.01, -1.01]]))
    signals = simulate(still).signals
    assert np.all(signals["speed"][0] == 0)
    assert signals["current"][0, -1] == pytest.approx(0.99 * enough / p["resistance value"])
    assert signals["speed"][1, -1] > 0.1
    np.testing.assert_allclose(signals["speed"][2], -signals["speed"][1], atol=1e-9)


@pytest.mark.parametrize(("machine", "quantity", "on"), [
    ("two tanks", "outflow 1", "level 1"), ("dc motor", "resistance", "current")])
def test_a_change_that_parameters_replace_has_no_strength(machine: str, quantity: str, on: str) -> None:
    runs = replace(nominal_runs(machine).take(np.arange(4)), count=400)
    scale = Scale(runs, quiet_world(machine, runs))
    constant = scale.measure(Change((quantity, on), quantity, on, CONSTANT), np.array([0.05]))[0]
    size = 8.0 if machine == "dc motor" else 1.0
    rising = scale.measure(Change((quantity, on), quantity, on, LINE, -size, size), np.array([0.05, 0.1]))
    assert constant is not None
    assert constant.strength < 0.1
    assert rising[0] is not None
    assert rising[1] is not None
    assert rising[0].strength > 4 * constant.strength
    assert rising[1].strength == pytest.approx(2 * rising[0].strength, rel=0.2)


def test_late_clocks_are_no_effect() -> None:
    runs = nominal_runs("two tanks")
    scale = Scale(runs, quiet_world("two tanks", runs))
    lag = Change(("level 1 sensor", "lag"), "level 1 sensor", "time", lag=Lag("dead_time", {}))
    short, long = scale.measure(lag, runs.period * np.array([1.0, 8.0]))
    assert short is not None
    assert long is not None
    assert short.strength < 0.15 < 0.6 < long.strength


def test_words_of_pairs() -> None:
    for machine, pairs in PAIRS.items():
        assert len(set(pairs)) == len(pairs) >= 20
        signals = {f"{name} sensor" for name in MACHINES[machine].SIGNALS}
        for quantity, on in pairs:
            assert on in ABSCISSAS[machine] or (quantity in signals and on in ("gain", "lag", "offset"))
        assert len({pair for group in EQUAL_PAIRS[machine] for pair in group}) == sum(map(len, EQUAL_PAIRS[machine]))
    assert accept_pairs("two tanks", ("leak 2", "level 2")) == {("leak 2", "level 2"), ("outflow 2", "level 2")}
    assert ("outflow 1", "level 1") in accept_pairs("two tanks", ("overflow", "level 1"))
    assert ("overflow", "level 1") not in accept_pairs("two tanks", ("outflow 1", "level 1"))


def test_equal_pairs_give_equal_recordings() -> None:
    runs = replace(nominal_runs("two tanks").take(np.arange(4)), count=200)
    gain = runs.values["pump gain"][0]
    over_level = [runs.with_change(Change((quantity, "level 1"), quantity, "level 1", LINE, 0.0, 1.0),
                                   np.full(4, amplitude)) for quantity, amplitude in (
        ("voltage", -1.0), ("leak 1", gain))]
    first, second = (simulate(each, 2).signals["level 1"] for each in over_level)
    np.testing.assert_allclose(first, second, atol=1e-12)
    machine = replace(nominal_runs("dc motor").take(np.arange(4)), count=200)
    over_current = [machine.with_change(Change((quantity, "current"), quantity, "current", LINE, -10.0, 10.0),
                                        np.full(4, amplitude)) for quantity, amplitude in (
        ("voltage", -1.0), ("brush voltage", 1.0))]
    first, second = (simulate(each, 2).signals["speed"] for each in over_current)
    np.testing.assert_allclose(first, second, atol=1e-9)


def test_cases_are_drawn_with_and_without_effects() -> None:
    cases = {seed: case_of(seed) for seed in SEEDS}
    for seed, case in cases.items():
        assert case.seed == seed
        assert case.machine == ("dc motor" if case.seed % 2 else "two tanks")
        assert 24 <= len(case.runs.order) <= 54
        assert (case.hidden is None) == (case.runs.change is None) == (case.seed // 2 % 4 == 3)
        if case.hidden is None:
            assert not case.runs.amplitude.any()
        else:
            assert 1 <= case.hidden.strength <= 10
            acts = case.runs.amplitude != 0
            assert acts.all() if case.hidden.share == 1 else 4 <= acts.sum() < 7
            assert case.hidden.share == 1 or case.hidden.change.abscissa not in CONSTANT_IN_A_RUN
    nothing = {case.name.split("/")[2].replace("-", " ") for case in cases.values() if case.hidden is None}
    assert "plain" in nothing
    assert len(nothing) > 2
    assert nothing - {"plain"} <= set(TEMPTATIONS)


def test_a_seed_determines_a_case() -> None:
    for case in (case_of(10), case_of(15)):
        again = draw_machine_case(case.seed)
        assert again.name == case.name
        first, second = (simulate(replace(each.runs.take(np.arange(3)), count=100), 2).signals
                         for each in (case, again))
        assert all(np.array_equal(first[name], second[name]) for name in first)
    assert not np.array_equal(case_of(0).runs.corner_value[0], case_of(10).runs.corner_value[0])


@pytest.mark.parametrize("seed", [0, 1])
def test_files_are_read_without_the_project(seed: int, tmp_path: Path) -> None:
    case, folder = case_of(seed), tmp_path / f"other_machines-{seed}"
    write_machine_case(folder, case)
    machine = json.loads((folder / "machine.json").read_text())
    assert (machine["machine"], set(machine["values"])) == (case.machine, set(MACHINES[case.machine].PARAMETERS))
    n = len(case.runs.order)
    with h5py.File(folder / "runs.h5") as file:
        time, command = file["time"][:], file["commands/voltage"]
        assert set(file["signals"]) == set(MACHINES[case.machine].SIGNALS)
        for name, unit in MACHINES[case.machine].SIGNALS.items():
            signal = file["signals"][name]
            assert (signal.attrs["units"], signal.shape) == (unit, (n, len(time)))
            assert np.isfinite(signal[:]).all()
        assert np.all(np.diff(command["time"][:], axis=1) > 0)
        assert command["value"].shape == command["time"].shape
        assert np.all(command["time"][:, -1] >= time[-1])
        assert sorted(file["order"][:]) == list(range(n))
        assert all(column.shape == (n,) for name in ("conditions", "channels") for column in file[name].values())
    truth = Truth.from_json(json.loads(truth_file(folder).read_text()))
    assert (truth.case, truth.runs, len(truth.hidden)) == (case.name, n, case.hidden is not None)
    silent = judge(Answer(case.name), truth)
    assert silent.silent
    for hidden in truth.hidden:
        verdict = judge(Answer(case.name, (NamedPair(hidden.pair, confidence=0.95),)), truth)
        assert verdict.right_first
        assert verdict.sure


def test_stated_conditions_are_off_only_where_they_tempt() -> None:
    runs = nominal_runs("dc motor")
    world = quiet_world("dc motor", runs)
    for name in ("plain", "conditions off"):
        tempted = TEMPTATIONS[name](world, {}, (1, 1), np.random.default_rng(1)) if name != "plain" else world
        actual, stated = vary(runs, tempted, np.random.default_rng(2))
        error = np.abs(actual.conditions["load torque"] - stated["load torque"])
        assert (error.max() > 0) == (name != "plain")
        assert np.all(error <= 0.04 * stated["load torque"])


def test_noise_and_spike_have_the_stated_size() -> None:
    case = case_of(0)
    reading = simulate(case.runs, 2)
    quiet = measure(reading, case.world, np.random.default_rng(1))
    for name, std in case.world.noise.items():
        assert np.std(quiet[name] - reading.signals[name]) == pytest.approx(std, rel=0.1)
    spike = Spike(2, "level 1", 50, 3, 0.4)
    spiked = measure(reading, replace(case.world, spike=spike), np.random.default_rng(1))
    difference = spiked["level 1"] - quiet["level 1"]
    np.testing.assert_allclose(difference[2, 50:53], 0.4, atol=1e-6)
    assert np.count_nonzero(difference) == 3
