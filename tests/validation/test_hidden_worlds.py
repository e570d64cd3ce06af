"""Worlds, bad runs and the other simulated test benches do what they state (tests/validation/hidden)."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np
import pytest
from hidden import INGREDIENTS, Case, World, draw, generate, simulate, truth, write
from hidden.bad_runs import KINDS, BadRun, corrupt, stick
from hidden.bad_runs import draw as draw_bad_runs
from hidden.drawn import SEEDS, Chance, admissible, nominal, text
from hidden.equations import _converter_torque
from hidden.nominal import BRISK, CHOSEN, COMPACT, DRAWN, GIANT, HEAVY, LIGHT, SETUPS, SLOW, Setup
from hidden.run import SIGNALS, observe
from hidden.world import with_errors, with_other_curves

from slipstick.bench import Bench
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings

HERE = Path(__file__).parent
NOMINAL = Case(shift="none", scatter=0, count=90, bench="compact")
FEW = replace(NOMINAL, count=5)
OTHERS = [setup for setup in SETUPS.values() if setup not in (HEAVY, COMPACT)]
SOME_DRAWN = [SETUPS[f"drawn{number:02}"]
              for number in (2, 4, 8, 13, 18, 22, 25, 29, 33, 38, 41, 45, 50, 54, 59, 62, 65, 71,
                             74, 77, 83, 86, 90, 94, 98, 101, 106, 110, 113, 117, 124, 126, 127,
                             137, 139, 144, 146, 148, 154, 158, 163, 167,
                             170, 174, 178)]
MARKED = [(setup, [pytest.mark.slow] * (place % 12 > 0)) for place, setup in enumerate(SOME_DRAWN)]
BENCHES = pytest.mark.parametrize("bench", [*(setup.name for setup in CHOSEN),
                                            *(pytest.param(setup.name, marks=marks) for setup, marks in MARKED)])


def bench_file(setup: Setup) -> Bench:
    return Bench.open((HERE / "hidden" / "data" if setup in CHOSEN else DRAWN) / f"{setup.name}.toml")


def test_shifting_times_of_the_compact_bench_agree_with_the_reference() -> None:
    nominal, *corners = np.loadtxt(HERE / "hidden" / "data" / "compact_shifting_times.csv", delimiter=",",
                                   skiprows=1)[:, 1:].T
    run = simulate(NOMINAL, relative=1e-6)
    assert np.max(np.abs(run.lock_time - nominal)) < 1e-4
    subset = np.arange(0, 90, 7)
    for (bias, position), times in zip(((0.8, 1.2), (1.2, 0.8)), corners, strict=True):
        values = {**run.bench.values, "aa": 1.1 * bias + 0 * times, "x30": 2e-4 * position + 0 * times}
        corner = observe(replace(run.bench, values=values).take(subset), subset, subset, relative=1e-6)
        assert np.max(np.abs(corner.lock_time - times[subset])) < 1e-4


@pytest.mark.parametrize(("setup", "earliest", "latest"), [
    (BRISK, 0.25, 1.4), (GIANT, 0.4, 2.8), (LIGHT, 0.25, 0.8), (SLOW, 0.25, 2.7),
    *(pytest.param(setup, 0.09, 2.4, marks=marks) for setup, marks in MARKED)],
    ids=lambda value: getattr(value, "name", ""))
def test_shifting_times_agree_with_those_of_the_bench_file(setup: Setup, earliest: float, latest: float) -> None:
    bench = bench_file(setup)
    assert bench.sample_time == setup.period
    points = np.array([[1.0, 1.0], [0.8, 1.2], [1.2, 0.8]])
    expected, status = ensemble.shifting_times(Model(bench.physics), bench.conditions,
                                               ("pressure_bias", "initial_position"), points, ensemble.TIGHT)
    assert np.all(status == ensemble.LOCKED)
    every = np.arange(len(setup.profile))
    expected = np.tile(expected, setup.repeats)
    run = simulate(Case(shift="none", scatter=0, bench=setup.name, count=len(every)), relative=1e-6)
    for (bias, position), times in zip(points, expected, strict=True):
        values = {**run.bench.values, "aa": setup.parameters["aa"] * bias + 0 * times,
                  "x30": setup.parameters["x30"] * position + 0 * times}
        there = observe(replace(run.bench, values=values), every, every, relative=1e-6)
        assert np.max(np.abs(there.lock_time - times)) < 1e-4
    assert earliest < expected.min() < expected.max() < latest


@pytest.mark.parametrize("setup", OTHERS, ids=lambda setup: setup.name)
def test_a_bench_file_has_the_conditions_and_the_sensors_of_the_bench(setup: Setup) -> None:
    bench = bench_file(setup)
    given = bench.conditions
    np.testing.assert_array_equal(np.tile(given.current_profile, setup.repeats), setup.profile)
    for name in ("motor_speed", "load_inertia", "brake_torque"):
        np.testing.assert_allclose(np.tile(getattr(given, name), setup.repeats), getattr(setup, name), rtol=1e-9)
    np.testing.assert_allclose(given.profile_time, setup.profile_time)
    np.testing.assert_allclose(given.profile_current, setup.profile_current)
    assert {name: bench.sensors[name].noise for name in SIGNALS} == setup.noise


@BENCHES
def test_a_file_with_a_world_can_be_opened_and_has_the_stated_conditions(bench: str, tmp_path: Path) -> None:
    case = Case({"wear": 0.1}, bench=bench, world="any", count=6, seed=3)
    write(tmp_path / "case.h5", case)
    opened, setup = Recordings.open(tmp_path / "case.h5"), SETUPS[bench]
    assert opened.signals is not None
    np.testing.assert_allclose(np.diff(opened.signals.time), setup.period)
    with h5py.File(tmp_path / "case.h5") as file:
        for name in ("motor_speed", "load_inertia", "brake_torque"):
            assert set(file[f"conditions/{name}"][:]) <= set(getattr(setup, name))
    assert b"wear" not in (tmp_path / "case.h5").read_bytes()


def test_the_drawn_benches_are_the_first_admissible_draws_of_a_stated_size() -> None:
    drawn = [setup for setup in OTHERS if setup not in CHOSEN]
    assert [setup.name for setup in drawn] == [f"drawn{number:02}" for number in range(1, 181)]
    assert all(24 <= len(setup.profile) <= 72 and 1 <= setup.repeats <= 4 for setup in drawn)
    assert all(0.001 <= setup.period <= 0.01 for setup in drawn)
    for number, attempt in ((1, 1), (13, 1), (33, 1), (40, 1), (54, 1), (66, 2), (77, 2), (86, 5), (104, 3),
                            (113, 5), (131, 2), (137, 5), (143, 3),
                            (149, 11), (153, 3), (159, 7), (166, 6), (171, 18), (175, 4)):
        setup = SETUPS[f"drawn{number:02}"]
        content, repeats = text(setup.name, Chance([SEEDS[number], number, attempt]))
        assert content == (DRAWN / f"{setup.name}.toml").read_text()
        assert admissible(setup, nominal(setup))
        assert repeats == setup.repeats


def test_a_world_without_deviations_changes_nothing() -> None:
    case = replace(FEW, seed=4)
    for one, other in zip(generate(case)[1:], generate(replace(case, world=World()))[1:], strict=True):
        np.testing.assert_equal(one, other)


@BENCHES
def test_ingredients_are_drawn_independently_of_each_other(bench: str) -> None:
    whole = draw(8, SETUPS[bench])
    assert Case(seed=8, bench=bench, world="any").drawn_world == whole
    for name in INGREDIENTS:
        only = draw(8, SETUPS[bench], [name])
        fields = [field for field in vars(only) if getattr(only, field) != getattr(World(), field)]
        assert fields
        assert all(getattr(only, field) == getattr(whole, field) for field in fields)
    assert draw(9, SETUPS[bench]).noise != whole.noise


def test_every_parameter_scatters_as_drawn_except_the_gear_ratio() -> None:
    world = draw(5, HEAVY, ["scatter"])
    values = simulate(Case(shift="none", world=world, seed=5), relative=1e-3).bench.values
    assert world.scatter is not None
    assert set(values) - set(world.scatter) == {"gr"}
    assert np.ptp(values["gr"]) == 0
    for name, std in world.scatter.items():
        assert np.std(values[name]) == pytest.approx(std * HEAVY.parameters[name], rel=0.2)
    drawn = [draw(seed, HEAVY, ["scatter"]).scatter or {} for seed in range(40)]
    for name, largest in (("x30", 0.1), ("aa", 0.05), ("Ji", 0.03)):
        assert 0.9 * largest < max(scatter[name] for scatter in drawn) < largest


@BENCHES
def test_noise_is_as_drawn(bench: str) -> None:
    world = draw(6, SETUPS[bench], ["noise"])
    assert world.noise is not None
    assert world.memory is not None
    run, _, signals = generate(Case(bench=bench, world=world, count=12), relative=1e-5)
    for name, reading in run.readings.items():
        noise = signals[name] - reading
        assert np.std(noise) == pytest.approx(world.noise[name] * np.ptp(reading), rel=0.06)
        correlation = np.mean(noise[:, 1:] * noise[:, :-1]) / np.var(noise)
        assert correlation == pytest.approx(world.memory[name], abs=0.05)


def test_noise_of_many_worlds_spans_the_specified_ranges() -> None:
    worlds = [draw(seed, HEAVY, ["noise"]) for seed in range(100)]
    std = np.array([list((world.noise or {}).values()) for world in worlds])
    memory = np.array([list((world.memory or {}).values()) for world in worlds])
    assert 0.003 <= std.min() < 0.0032
    assert 0.025 < std.max() < 0.03
    assert 0.5 < np.mean(std < 0.0075) < 0.65
    assert (memory.min() < 0.05, memory.max() > 0.85, memory.max() < 0.9) == (True, True, True)


def test_both_converter_curves_have_a_smooth_error() -> None:
    changed = with_other_curves(COMPACT, 0.02, np.random.default_rng(2))
    errors = [changed.torque_ratio / COMPACT.torque_ratio - 1, changed.capacity / COMPACT.capacity - 1]
    for error in errors:
        assert np.sqrt(np.mean(error**2)) == pytest.approx(0.02)
        assert np.max(np.abs(np.diff(error))) < 0.03
    assert np.ptp(errors[0]) > 0.01
    assert abs(np.corrcoef(*errors)[0, 1]) < 0.99


def test_each_level_of_a_condition_has_one_error() -> None:
    actual = with_errors(COMPACT.brake_torque, 0.02, np.random.default_rng(1))
    errors = {level: set(actual[level == COMPACT.brake_torque] / level) for level in np.unique(COMPACT.brake_torque)}
    assert all(len(values) == 1 for values in errors.values())
    assert len(set.union(*errors.values())) == 3
    assert max(abs(value - 1) for value in set.union(*errors.values())) < 0.04


def test_the_motor_sags_under_the_torque_of_the_pump() -> None:
    bench = simulate(FEW, relative=1e-3).bench
    sagging = replace(bench, sag=0.02)
    stalled = _converter_torque(sagging, 0 * bench.motor_speed) / _converter_torque(bench, 0 * bench.motor_speed)
    load = (bench.motor_speed / np.max(COMPACT.motor_speed)) ** 2
    np.testing.assert_allclose(stalled, (1 - 0.02 * load) ** 2, atol=2e-3)
    coasting = 0.999 * bench.motor_speed
    np.testing.assert_allclose(_converter_torque(sagging, coasting), _converter_torque(bench, coasting), rtol=0.1)


def test_a_late_clock_shows_the_signal_of_a_moment_before() -> None:
    on_time = simulate(FEW, relative=1e-4)
    late = simulate(replace(FEW, world=World(clocks={"input_speed": 0.25, "output_torque": 0.75})), relative=1e-4)
    setup = FEW.setup
    finer = observe(replace(on_time.bench, setup=replace(setup, period=setup.period / 4)), on_time.conditions,
                    on_time.order, relative=1e-4)
    for name, quarters in (("input_speed", 1), ("output_torque", 3)):
        reading = finer.readings[name]
        np.testing.assert_allclose(late.readings[name][:, 1:], reading[:, 4 - quarters::4], rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(late.readings[name][:, 0], on_time.readings[name][:, 0])
    np.testing.assert_array_equal(late.readings["pressure"], on_time.readings["pressure"])
    # At the corner of the torque's onset and at lock-up a blend of two samples is off by a part of the jump.
    torque = on_time.readings["output_torque"]
    blend = 0.25 * torque[:, 1:] + 0.75 * torque[:, :-1]
    assert np.abs(late.readings["output_torque"][:, 1:] - blend).max() > 0.02 * torque.max()


def test_about_two_percent_of_the_runs_are_bad_in_all_ways() -> None:
    drawn = [draw_bad_runs(np.arange(54), 0.02, HEAVY, np.random.default_rng(seed)) for seed in range(200)]
    assert 1 <= np.mean([len(bad) for bad in drawn]) < 1.7
    assert {bad.kind for runs in drawn for bad in runs} == set(KINDS)


def test_bad_runs_change_their_own_signals_only() -> None:
    time = np.arange(10.0)
    good = {name: 100 * number + np.arange(40.0).reshape(4, 10) for number, name in enumerate(SIGNALS, start=1)}
    signals = {name: signal.copy() for name, signal in good.items()}
    corrupt(signals, time, (BadRun(0, "channels swapped", "pressure", "output_torque", run=0),
                            BadRun(1, "sign flipped", "pressure", run=1),
                            BadRun(2, "sensor frozen", "pressure", start=4.0, run=2)))
    np.testing.assert_array_equal(signals["pressure"][0], good["output_torque"][0])
    np.testing.assert_array_equal(signals["output_torque"][0], good["pressure"][0])
    np.testing.assert_array_equal(signals["pressure"][1], -good["pressure"][1])
    np.testing.assert_array_equal(signals["pressure"][2], np.minimum(good["pressure"][2], good["pressure"][2, 4]))
    np.testing.assert_array_equal(signals["pressure"][3], good["pressure"][3])
    np.testing.assert_array_equal(signals["input_speed"], good["input_speed"])


def test_a_valve_sticks_and_catches_up() -> None:
    time, current = stick(np.array([0.0, 1, 2, 3]), np.array([0.0, 1, 0, 3]), 0.5, 1.0)
    np.testing.assert_allclose(np.interp([0.4, 0.5, 1, 1.5, 1.6, 2, 3], time, current), [0.4, 0.5, 0.5, 0.5, 0.4, 0, 3])
    assert len(time) == 7
    assert all(before <= after for before, after in pairwise(time))


def test_a_wrong_profile_is_recorded_and_told_by_the_truth(tmp_path: Path) -> None:
    seeds = (seed for seed in range(100) if "wrong profile" in
             {bad["kind"] for bad in truth(bad_case(seed), relative=1e-2)["bad_runs"]})
    case = bad_case(next(seeds))
    write(tmp_path / "case.h5", case, relative=1e-4)
    with h5py.File(tmp_path / "case.h5") as file:
        recorded = file["conditions/current_profile"][:]
    actual = HEAVY.profile[simulate(case, relative=1e-4).conditions]
    wrong = [bad["run"] for bad in truth(case, relative=1e-4)["bad_runs"] if bad["kind"] == "wrong profile"]
    np.testing.assert_array_equal(np.flatnonzero(recorded != actual), wrong)


def bad_case(seed: int) -> Case:
    return Case(seed=seed, count=4, world=World(bad_runs=0.02))
