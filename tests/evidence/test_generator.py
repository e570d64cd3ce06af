"""The generator is independent and accurate, and its deviations do what they state."""

import ast
import sys
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.signal import argrelmin

from evidence.generator import strength as strength_module
from evidence.generator.bad_runs import KINDS, BadRun, corrupt, draw, stick
from evidence.generator.bench import SENSORS
from evidence.generator.case import Hidden, bad_runs_of, choose_runs, measure, measure_further, simulate
from evidence.generator.dependences import KNOWN, KNOWN_PAIRS, OVER_TEMPERATURE, UNKNOWN
from evidence.generator.draw_bench import ENGAGEMENTS, draw_bench, run_nominal
from evidence.generator.effect import Acting, Effect
from evidence.generator.equations import _converter_torque
from evidence.generator.files import write_recordings
from evidence.generator.run import Run, observe
from evidence.generator.sensors import add_noise
from evidence.generator.states import TOLERANCE
from evidence.generator.strength import Scale
from evidence.generator.temptations import TEMPTATIONS, oil_temperature, second_batch
from evidence.generator.truth import Truth, describe
from evidence.generator.valve import play, plays
from evidence.generator.world import INGREDIENTS, World, draw_world, with_errors, with_other_curves
from slipstick.bench.reader import read
from slipstick.clutch import ensemble
from slipstick.clutch.effects import CATALOGUE
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings
from tests.hidden_laws import CONVERTER_LAGS, EXACT, FRICTION_FALLS, TABLES, case_of, law, shipped

pytestmark = pytest.mark.slow  # what draws the cases of the evidence is no part of the product

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "validation" / "data"


@pytest.mark.parametrize("path", sorted((ROOT / "evidence" / "generator").glob("*.py")), ids=lambda path: path.name)
def test_it_imports_nothing_of_the_project(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text())):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom):
            assert node.level <= 1
            names = [] if node.level else [node.module or ""]
        for name in names:
            assert name.split(".")[0] in {"numpy", "scipy", "h5py", *sys.stdlib_module_names}, name
            assert name != "importlib"


@pytest.fixture(scope="module")
def nominal_run() -> Run:
    return simulate(case_of(seed=1, count=216, world=EXACT, shift=0.0))


@pytest.fixture(scope="module")
def drawn() -> Run:
    """The nominal runs of a drawn bench."""
    return draw_bench([2026, 3])[1]


def test_nominal_shifting_times_agree_with_the_reference(nominal_run: Run) -> None:
    nominal, *corners = np.loadtxt(DATA / "shifting_times.csv", delimiter=",", skiprows=1)[:, 1:].T
    assert np.max(np.abs(nominal_run.lock_time - nominal)) < 1e-5
    engagements, subset = nominal_run.engagements, np.arange(0, 216, 7)
    lanes = engagements.take(np.tile(subset, 4))  # of all corners in one integration
    bias, position = (np.repeat(column, len(subset)) for column in zip(*product((0.5, 1.5), repeat=2), strict=True))
    each = np.arange(len(bias))
    corner = observe(replace(lanes, values={**lanes.values, "aa": 1.6 * bias, "x30": 5e-4 * position}), each, each)
    assert np.max(np.abs(corner.lock_time - np.ravel([times[subset] for times in corners]))) < 1e-5


def test_runs_that_do_not_lock_are_left_out_also_where_these_are_all(nominal_run: Run) -> None:
    some = np.arange(3)
    lanes = nominal_run.engagements.take(some)
    idle = observe(replace(lanes, values={**lanes.values, "aa": np.full(3, 100.0)}), some, some, 1e-4)
    assert len(idle.conditions) == 0


def test_nominal_signals_agree_with_the_reference(nominal_run: Run) -> None:
    rows = np.loadtxt(DATA / "trajectories.csv", delimiter=",", skiprows=1)
    for condition in (0, 100, 215):
        reference = rows[rows[:, 0] == condition]
        samples = np.searchsorted(shipped("heavy").time, reference[:, 1] - 1e-6)
        for column, name in enumerate((*SENSORS, "piston_position"), start=2):
            error = nominal_run.quantities[name][condition, samples] - reference[:, column]
            assert np.max(np.abs(error)) < 1e-4 * np.ptp(reference[:, column]), name


def test_a_drawn_bench_is_admissible_and_the_simulator_reads_the_same_from_its_file(drawn: Run) -> None:
    bench = drawn.engagements.bench
    theirs = read(bench.text.encode(), "drawn.toml", TABLES)
    times, status = ensemble.shifting_times(Model(theirs.physics), theirs.conditions, accuracy=ensemble.TIGHT)
    locked = np.isfinite(drawn.lock_time) & (status.ravel()[:len(bench.grid)] == ensemble.LOCKED)
    assert locked.mean() > 0.9
    assert np.max(np.abs(times.ravel()[bench.grid] - drawn.lock_time)[locked]) < 2e-4
    assert len(bench.profile) in ENGAGEMENTS
    assert {name: theirs.sensors[name].noise for name in SENSORS} == bench.noise
    assert (theirs.sample_time, draw_bench([2026, 3])[0].text) == (bench.period, bench.text)
    assert draw_bench([2026, 4])[0].text != bench.text


def test_known_dependences_are_those_of_the_catalogue() -> None:
    catalogue = {pair for effect in CATALOGUE for pair in effect.pairs}
    alike = {("contact pressure", "lag"): ("friction coefficient", "lag"),
             ("brake torque", "output speed"): ("load torque", "output speed")}
    assert {alike.get(pair, pair) for pair in catalogue} == set(KNOWN_PAIRS)
    assert {each.pair for each in KNOWN} == set(KNOWN_PAIRS)
    assert not {each.pair for each in (*UNKNOWN, *OVER_TEMPERATURE)} & KNOWN_PAIRS


def test_what_a_quantity_depends_on_is_known_where_the_equations_compute_it(drawn: Run) -> None:
    engagements, state = drawn.engagements.take(np.zeros(1, int)), np.zeros((len(TOLERANCE), 1))
    for each in (*KNOWN, *UNKNOWN):
        effect = Effect(each.pair, each.block, each.quantity, each.abscissa, "difference", lambda _, x: np.ones_like(x))
        acting = Acting(effect, 1.0, np.ones(1, bool))
        replace(engagements, effects=(acting,)).quantities(np.zeros(1), state, np.zeros((3, 1), int))


def test_a_law_changes_its_quantity_in_the_runs_in_which_it_acts() -> None:
    plain, hidden = (simulate(case_of(*laws, seed=2, count=8, world=EXACT), 1e-6) for laws in (
        (), [replace(FRICTION_FALLS, share=0.5)]))
    acts = hidden.engagements.effects[0].acts
    assert acts.sum() == 4
    for name in SENSORS:
        np.testing.assert_allclose(hidden.readings[name][~acts], plain.readings[name][~acts], atol=1e-3 * 200)
    assert np.abs(hidden.readings["output_torque"][acts] - plain.readings["output_torque"][acts]).max() > 20


def test_runs_of_an_effect_follow_each_other_or_do_not() -> None:
    order = np.random.default_rng(1).permutation(40)
    chosen = [choose_runs(0.1, order, np.random.default_rng(seed)) for seed in range(40)]
    assert {int(each.sum()) for each in chosen} == {4}
    follow = [np.ptp(order[each]) == 3 for each in chosen]
    assert 10 < sum(follow) < 30


def test_a_compliant_shaft_rings_after_lock_up() -> None:
    heavy = shipped("heavy")
    soft = law("shaft_compliance", "twist", lambda x: 2e-4 + 0 * x, "difference")
    run = simulate(case_of(soft, seed=3, count=4, world=EXACT, shift=0.0), 1e-6)
    slip = run.quantities["input_speed"] / 3.2 - run.quantities["output_speed"]
    rigid = 1 / 2.56 + 1 / run.engagements.load_inertia
    for lane, locked in enumerate(run.lock_time):
        first, second = argrelmin(slip[lane, locked < heavy.time])[0][:2]
        assert heavy.time[second - first] == pytest.approx(2 * np.pi / np.sqrt(rigid[lane] / 2e-4), rel=0.06)


def test_play_holds_the_current_at_reversals_and_several_are_their_weighted_mean() -> None:
    knots = np.array([[0.0, 1, 2, 3]]), np.array([[0.0, 1, 0, 1]])
    time, current = play(*knots, 0.2, 0.1)
    samples = np.array([0.1, 0.5, 1, 1.2, 1.6, 2, 2.2, 3])
    np.testing.assert_allclose(np.interp(samples, time[0], current[0]), [0, 0.3, 0.8, 0.8, 0.5, 0.1, 0.1, 0.8])
    wide = np.interp(samples, *(column[0] for column in play(*knots, 0.4, 0.2)))
    both = plays(*knots, np.array([0.2, 0.4]), np.array([0.1, 0.2]), np.array([0.25, 0.75]))
    np.testing.assert_allclose(np.interp(samples, both[0][0], both[1][0]),
                               0.25 * np.interp(samples, time[0], current[0]) + 0.75 * wide)


def test_a_response_makes_the_reading_of_its_sensor_late() -> None:
    def late(signal: np.ndarray, period: float, delay: float) -> np.ndarray:
        steps = round(delay / period)
        return np.concatenate([np.repeat(signal[:, :1], steps, axis=1), signal[:, :-steps]], axis=1)

    effect = Effect(("pressure sensor", "lag"), "pressure", "pressure_sensor_lag", "sequence", "difference",
                    lambda amplitude, x: amplitude + 0 * x, response=late)
    plain, hidden = (simulate(case_of(*laws, seed=4, count=4, world=EXACT), 1e-5) for laws in (
        (), [Hidden(effect, 0.01)]))
    np.testing.assert_array_equal(hidden.readings["pressure"][:, 5:], plain.readings["pressure"][:, :-5])
    np.testing.assert_array_equal(hidden.readings["input_speed"], plain.readings["input_speed"])


def test_the_strength_is_the_residual_after_a_fit_over_the_noise(drawn: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("LANES", 6), ("RELATIVE", 1e-3)):
        monkeypatch.setattr(strength_module, name, value)
    ranges = drawn.engagements.bench.ranges
    scale, finer = (Scale(drawn, {name: share * ranges[name] for name in SENSORS}) for share in (0.01, 0.005))
    wave = Effect(("friction coefficient", "slip"), "torque", "friction_coefficient", "slip", "ratio",
                  lambda amplitude, v: 1 + amplitude * np.sin(v / 3))
    constant = replace(wave, law=lambda amplitude, v: 1 + amplitude + 0 * v)
    strength = scale.measure(wave, 0.1)
    assert strength > 0.3
    assert finer.measure(wave, 0.1) == pytest.approx(2 * strength, rel=0.15)  # the parameters of runs have a prior
    assert scale.measure(constant, 0.05) < 0.2 * strength  # what a calibration makes up for is no strength
    assert scale.measure(wave, 0.0) == pytest.approx(0, abs=1e-9)


def test_noise_has_the_stated_std_and_autocorrelation() -> None:
    readings = {name: np.linspace(0, 100, 4000) * np.ones((30, 1)) for name in SENSORS}
    signals = add_noise(readings, dict.fromkeys(SENSORS, 0.7), dict.fromkeys(SENSORS, 0.4), np.random.default_rng(1))
    for name, reading in readings.items():
        noise = signals[name] - reading
        assert np.std(noise) == pytest.approx(0.7, rel=0.02)
        assert np.mean(noise[:, 1:] * noise[:, :-1]) / np.var(noise) == pytest.approx(0.4, abs=0.02)
        assert len(np.unique(signals[name])) < 4500


def test_a_subset_of_the_conditions_has_every_level_about_equally_often() -> None:
    run = simulate(case_of(seed=5, count=54, world=EXACT), 1e-3)
    engagements = run.engagements
    for factor in (engagements.motor_speed, engagements.load_inertia, engagements.brake_torque, run.conditions // 36):
        assert np.ptp(np.unique(factor, return_counts=True)[1]) <= 1


def test_files_have_the_layout_of_the_shipped_recordings_and_no_truth(tmp_path: Path) -> None:
    case = case_of(FRICTION_FALLS, seed=11, count=20)
    run = simulate(case, 1e-5)
    for name in ("first.h5", "second.h5"):
        write_recordings(tmp_path / name, case, run)
    assert (tmp_path / "first.h5").read_bytes() == (tmp_path / "second.h5").read_bytes()
    assert layout(tmp_path / "first.h5") == layout(TABLES / "measured.h5")
    opened = Recordings.open(tmp_path / "first.h5")
    assert opened.signals is not None
    assert opened.run_order is not None
    assert sorted(opened.run_order) == list(range(20))
    write_recordings(tmp_path / "partial.h5", replace(case, missing=("pressure", "input_speed")), run)
    partial = Recordings.open(tmp_path / "partial.h5").signals
    assert partial is not None
    assert partial.names == ("output_speed", "output_torque")
    np.testing.assert_array_equal(partial["output_torque"], opened.signals["output_torque"])


def layout(path: Path) -> dict[str, tuple[str, dict[str, str]]]:
    items = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: items.update({name: (str(getattr(item, "dtype", "")), dict(item.attrs))}))
    return items


def test_the_truth_tabulates_the_law() -> None:
    case = case_of(FRICTION_FALLS, seed=6, count=12)
    run = simulate(case, 1e-5)
    truth = describe(case, run)
    assert Truth.from_json(truth.to_json()) == truth
    hidden, = truth.hidden
    grid = np.array(hidden.grid)
    np.testing.assert_allclose(hidden.change, 1 + 0.2 * np.exp(-((grid / 14) ** 1.3)))
    assert sum(hidden.visits) == pytest.approx(1)
    assert hidden.base == pytest.approx(3.2e-4, rel=0.1)


def test_ingredients_of_a_world_are_drawn_independently_of_each_other(drawn: Run) -> None:
    bench = drawn.engagements.bench
    whole = draw_world([8], bench)
    for name in INGREDIENTS:
        only = draw_world([8], bench, [name])
        fields = [field for field in vars(only) if getattr(only, field) != getattr(World(), field)]
        assert fields
        assert all(getattr(only, field) == getattr(whole, field) for field in fields)
    assert draw_world([9], bench).noise != whole.noise


def test_every_parameter_scatters_as_drawn_except_the_gear_ratio() -> None:
    heavy = shipped("heavy")
    world = draw_world([5], heavy, ["scatter"])
    values = simulate(case_of(seed=5, count=216, world=world, shift=0.0), 1e-3).engagements.values
    assert set(values) - set(world.scatter) == {"gr"}
    assert np.ptp(values["gr"]) == 0
    for name, std in world.scatter.items():
        assert np.std(values[name]) == pytest.approx(std * heavy.parameters[name], rel=0.2)


def test_factors_multiply_the_mean_of_a_parameter() -> None:
    values = simulate(case_of(seed=5, count=6, world=EXACT, shift=0.0, factors={"Ji": 1.4}), 1e-3).engagements.values
    assert set(values["Ji"] / shipped("heavy").parameters["Ji"]) == {1.4}


def test_noise_of_many_worlds_spans_the_stated_ranges() -> None:
    heavy = shipped("heavy")
    worlds = [draw_world([seed], heavy, ["noise"]) for seed in range(200)]
    std = np.array([[world.noise[name] / heavy.ranges[name] for name in SENSORS] for world in worlds])
    memory = np.array([[*world.memory.values()] for world in worlds])
    assert 0.0005 < std.min() < 0.003  # half of the stated noise, or 0.3 % of the range
    assert 0.02 < std.max() < 0.03
    assert (memory.min() < 0.05, memory.max() > 0.85, memory.max() < 0.9) == (True, True, True)


def test_both_converter_curves_have_a_smooth_error() -> None:
    compact = shipped("compact")
    changed = with_other_curves(compact, 0.02, np.random.default_rng(2))
    errors = [changed.torque_ratio / compact.torque_ratio - 1, changed.capacity / compact.capacity - 1]
    for error in errors:
        assert np.sqrt(np.mean(error**2)) == pytest.approx(0.02)
        assert np.max(np.abs(np.diff(error))) < 0.03
    assert np.ptp(errors[0]) > 0.01
    assert abs(np.corrcoef(*errors)[0, 1]) < 0.99


def test_each_level_of_a_condition_has_one_error() -> None:
    compact = shipped("compact")
    actual = with_errors(compact.brake_torque, 0.02, np.random.default_rng(1))
    errors = {level: set(actual[level == compact.brake_torque] / level) for level in np.unique(compact.brake_torque)}
    assert all(len(values) == 1 for values in errors.values())
    assert len(set.union(*errors.values())) == 3
    assert max(abs(value - 1) for value in set.union(*errors.values())) < 0.04


def test_the_motor_sags_under_the_torque_of_the_pump() -> None:
    lanes = simulate(case_of(seed=5, count=5, bench="compact", world=EXACT), 1e-3).engagements
    sagging = replace(lanes, sag=0.02)
    stalled = _converter_torque(sagging, 0 * lanes.motor_speed) / _converter_torque(lanes, 0 * lanes.motor_speed)
    load = (lanes.motor_speed / np.max(shipped("compact").motor_speed)) ** 2
    np.testing.assert_allclose(stalled, (1 - 0.02 * load) ** 2, atol=2e-3)


def test_a_late_clock_shows_the_signal_of_a_moment_before() -> None:
    clocks = {"input_speed": 0.25, "output_torque": 0.75}
    on_time, late = (simulate(case_of(seed=7, count=5, bench="compact", world=world), 1e-4) for world in (
        EXACT, World(clocks=clocks)))
    finer_bench = replace(on_time.engagements.bench, period=shipped("compact").period / 4)
    finer = observe(replace(on_time.engagements, bench=finer_bench), on_time.conditions, on_time.order, 1e-4)
    for name, quarters in (("input_speed", 1), ("output_torque", 3)):
        reading = finer.readings[name]
        np.testing.assert_allclose(late.readings[name][:, 1:], reading[:, 4 - quarters::4], rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(late.readings[name][:, 0], on_time.readings[name][:, 0])
    np.testing.assert_array_equal(late.readings["pressure"], on_time.readings["pressure"])


def test_bad_runs_are_of_all_kinds_and_change_their_own_signals_only() -> None:
    many = [draw(np.arange(54), 0.02, shipped("heavy"), np.random.default_rng(seed)) for seed in range(200)]
    assert 1 <= np.mean([len(bad) for bad in many]) < 1.7
    assert {bad.kind for runs in many for bad in runs} == set(KINDS)
    time = np.arange(10.0)
    good = {name: 100 * number + np.arange(40.0).reshape(4, 10) for number, name in enumerate(SENSORS, start=1)}
    signals = {name: signal.copy() for name, signal in good.items()}
    corrupt(signals, time, (BadRun(0, "channels swapped", "pressure", "output_torque", run=0),
                            BadRun(1, "sign flipped", "pressure", run=1),
                            BadRun(2, "sensor frozen", "pressure", start=4.0, run=2)))
    np.testing.assert_array_equal(signals["pressure"][0], good["output_torque"][0])
    np.testing.assert_array_equal(signals["output_torque"][0], good["pressure"][0])
    np.testing.assert_array_equal(signals["pressure"][1], -good["pressure"][1])
    np.testing.assert_array_equal(signals["pressure"][2], np.minimum(good["pressure"][2], good["pressure"][2, 4]))
    np.testing.assert_array_equal(signals["input_speed"], good["input_speed"])


def test_a_valve_sticks_and_catches_up() -> None:
    time, current = stick(np.array([0.0, 1, 2, 3]), np.array([0.0, 1, 0, 3]), 0.5, 1.0)
    np.testing.assert_allclose(np.interp([0.4, 0.5, 1, 1.5, 1.6, 2, 3], time, current), [0.4, 0.5, 0.5, 0.5, 0.4, 0, 3])
    assert len(time) == 7
    assert all(before <= after for before, after in pairwise(time))


def test_a_wrong_profile_is_recorded_and_told_by_the_truth(tmp_path: Path) -> None:
    case = next(case for case in (case_of(seed=seed, count=4, world=World(bad_runs=0.02)) for seed in range(100))
                if bad_runs_of(case, np.arange(216))[0].kind == "wrong profile")
    run = simulate(case, 1e-4)
    write_recordings(tmp_path / "case.h5", case, run)
    with h5py.File(tmp_path / "case.h5") as file:
        recorded = file["conditions/current_profile"][:]
    wrong = [bad.run for bad in describe(case, run).bad_runs]
    np.testing.assert_array_equal(np.flatnonzero(recorded != shipped("heavy").profile[run.conditions]), wrong)


def test_batches_have_other_errors_and_noise() -> None:
    noise = dict.fromkeys(SENSORS, 1.0)
    case = case_of(seed=8, count=36, world=World(noise=noise, conditions=0.02, batches=True))
    run = simulate(case, 1e-4)
    later = second_batch(run.order)
    nominal, actual = shipped("heavy").motor_speed[run.conditions], run.engagements.motor_speed
    errors = [{level: set((actual / nominal)[half & (nominal == level)].round(9)) for level in set(nominal)}
              for half in (later, ~later)]
    assert all(len(values) <= 1 for half in errors for values in half.values())
    assert errors[0] != errors[1]
    std = np.std(measure(case, run)[1]["input_speed"] - run.readings["input_speed"], axis=1)
    assert std[later].mean() / std[~later].mean() == pytest.approx(1.3 / 0.7, rel=0.1)


def test_the_ambient_changes_speed_and_brake_torque_over_the_test_sequence() -> None:
    heavy = shipped("heavy")
    run = simulate(case_of(seed=9, count=36, world=World(ambient=0.02)), 1e-4)
    lanes = run.engagements
    assert np.array_equal(lanes.load_inertia, heavy.load_inertia[run.conditions])
    for actual, nominal in ((lanes.motor_speed, heavy.motor_speed), (lanes.brake_torque, heavy.brake_torque)):
        change = (actual / nominal[run.conditions])[np.argsort(run.order)]
        assert abs(change[-1] - change[0]) == pytest.approx(0.02)


def test_temptations_change_a_world_as_they_say() -> None:
    heavy = shipped("heavy")
    loud = TEMPTATIONS["loud_sensor"](World(), heavy, np.random.default_rng(1))
    sensor, = (name for name in SENSORS if loud.noise[name])
    assert (loud.noise[sensor], loud.memory[sensor]) == (0.03 * heavy.ranges[sensor], 0.9)
    assert TEMPTATIONS["many_bad_runs"](World(bad_runs=0.02), heavy, np.random.default_rng(1)).bad_runs == 0.1
    assert TEMPTATIONS["thermometer"](World(), heavy, np.random.default_rng(1)).thermometer


def test_a_thermometer_writes_the_oil_temperature_and_changes_nothing_else(tmp_path: Path) -> None:
    plain, case = (case_of(seed=10, count=36, world=World(thermometer=is_there)) for is_there in (False, True))
    run = simulate(case, 1e-4)
    np.testing.assert_equal(measure(case, run)[1], measure(plain, simulate(plain, 1e-4))[1])
    write_recordings(tmp_path / "case.h5", case, run)
    channel = Recordings.open(tmp_path / "case.h5").further["oil_temperature"]
    assert channel.unit == "degC"
    np.testing.assert_allclose(channel.values, measure_further(case, run)["oil_temperature"])
    np.testing.assert_allclose(channel.values.mean(axis=1), run.engagements.channels["oil_temperature"], atol=0.1)


def test_the_oil_is_warmed_twice_so_that_its_temperature_is_not_the_run_order() -> None:
    temperature = oil_temperature(np.arange(54), np.random.default_rng(3))
    assert (temperature[:5].mean(), temperature[-5:].mean()) == pytest.approx((46, 87), abs=4)
    assert temperature[18:22].mean() > temperature[22:26].mean() + 8


def test_a_lag_of_the_converter_starts_in_balance() -> None:
    run = simulate(case_of(CONVERTER_LAGS, seed=12, count=4, world=EXACT), 1e-5)
    assert np.abs(np.diff(run.readings["input_speed"][:, :20], axis=1)).max() < 0.2


def test_pace_and_ranges_are_those_of_the_nominal_runs(drawn: Run) -> None:
    bench = run_nominal(drawn.engagements.bench).engagements.bench
    assert bench.pace == pytest.approx(np.median(drawn.lock_time), rel=1e-3)
    assert bench.ranges == pytest.approx({name: np.ptp(drawn.readings[name]) for name in SENSORS}, rel=1e-2)
