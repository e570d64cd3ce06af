"""The simulated test bench is independent and accurate, and its effects are visible (tests/validation/hidden)."""

import ast
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path

import h5py
import numpy as np
import pytest
from hidden import EFFECTS, PHYSICAL, SENSORS, UNLISTED, Case, generate, remaining, simulate, truth, write
from hidden.effect import Effect
from hidden.run import SIGNALS, TIME, Run, observe
from hidden.sensors import NOISE_MEMORY
from hidden.valve import play
from scipy.signal import argrelmin

from slipstick.recordings import Recordings

HERE = Path(__file__).parent
SHIPPED = HERE.parents[1] / "tables" / "measured.h5"
NOMINAL = Case(shift="none", scatter=0)
FEW = replace(NOMINAL, count=4)


@pytest.mark.parametrize("path", sorted((HERE / "hidden").glob("*.py")), ids=lambda path: path.name)
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
    return simulate(NOMINAL)


def test_nominal_shifting_times_agree_with_the_reference(nominal_run: Run) -> None:
    nominal, *corners = np.loadtxt(HERE / "data" / "shifting_times.csv", delimiter=",", skiprows=1)[:, 1:].T
    assert np.max(np.abs(nominal_run.lock_time - nominal)) < 1e-5
    bench, subset = nominal_run.bench, np.arange(0, 216, 7)
    for (bias, position), times in zip(product((0.5, 1.5), repeat=2), corners, strict=True):
        values = {**bench.values, "aa": 1.6 * bias + 0 * times, "x30": 5e-4 * position + 0 * times}
        run = observe(replace(bench, values=values).take(subset), subset, subset)
        assert np.max(np.abs(run.lock_time - times[subset])) < 1e-5


def test_nominal_signals_agree_with_the_reference(nominal_run: Run) -> None:
    rows = np.loadtxt(HERE / "data" / "trajectories.csv", delimiter=",", skiprows=1)
    for condition in (0, 100, 215):
        reference = rows[rows[:, 0] == condition]
        samples = np.searchsorted(TIME, reference[:, 1] - 1e-6)
        for column, name in enumerate((*SIGNALS, "piston_position"), start=2):
            error = nominal_run.quantities[name][condition, samples] - reference[:, column]
            assert np.max(np.abs(error)) < 1e-4 * np.ptp(reference[:, column]), name


@pytest.fixture(scope="module")
def nominal_readings() -> dict[str, np.ndarray]:
    return readings({})


@pytest.fixture(scope="module")
def numerical_error(nominal_readings: dict[str, np.ndarray]) -> float:
    return max(differences(nominal_readings, simulate(FEW).readings).values())


def readings(effects: dict[str, float]) -> dict[str, np.ndarray]:
    return simulate(replace(FEW, effects=effects), relative=1e-5).readings


def differences(signals: dict[str, np.ndarray], reference: dict[str, np.ndarray]) -> dict[str, float]:
    """Return the RMS difference of each signal, relative to the range of the reference."""
    return {name: float(np.sqrt(np.mean((signals[name] - reference[name]) ** 2)) / np.ptp(reference[name]))
            for name in reference}


@pytest.mark.parametrize("effect", [*PHYSICAL, *UNLISTED], ids=lambda effect: effect.name)
def test_an_effect_is_visible(effect: Effect, nominal_readings: dict[str, np.ndarray], numerical_error: float) -> None:
    changes = differences(readings({effect.name: effect.typical}), nominal_readings)
    assert max(1e-3, 10 * numerical_error) < max(changes.values()) < 0.1


@pytest.mark.parametrize("kind", ["lag", "offset", "gain"])
def test_a_sensor_effect_changes_only_its_own_signal(
        kind: str, nominal_readings: dict[str, np.ndarray], numerical_error: float) -> None:
    effects = {effect.name: effect.typical for effect in SENSORS if effect.name.endswith(kind)}
    assert len(effects) == len(SIGNALS)
    first = next(iter(effects))
    single = differences(readings({first: effects[first]}), nominal_readings)
    assert [name for name in single if single[name]] == [first.split("_sensor")[0]]
    changes = differences(readings(effects), nominal_readings)
    assert max(1e-3, 10 * numerical_error) < min(changes.values())
    assert max(changes.values()) < 0.1


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
def test_a_law_is_neutral_at_strength_zero(effect: Effect) -> None:
    np.testing.assert_array_equal(effect.law(0.0, np.linspace(0.01, 100, 50)), 1 if effect.kind == "ratio" else 0)


def test_effects_of_strength_zero_change_nothing(nominal_readings: dict[str, np.ndarray]) -> None:
    neutral = readings(dict.fromkeys(EFFECTS, 0.0))
    for name, signal in nominal_readings.items():
        np.testing.assert_array_equal(neutral[name], signal)


def test_number_and_blocks_of_the_effects() -> None:
    assert (len(PHYSICAL), len(SENSORS), len(UNLISTED)) == (20, 12, 10)
    assert len(EFFECTS) == 42
    assert {effect.block for effect in UNLISTED} == {"pressure", "torque", "output speed", "input speed"}


def test_a_compliant_shaft_rings_after_lock_up() -> None:
    run = simulate(replace(FEW, effects={"shaft_compliance": 2e-4}))
    slip = run.quantities["input_speed"] / 3.2 - run.quantities["output_speed"]
    rigid = 1 / 2.56 + 1 / run.bench.load_inertia
    for lane, locked in enumerate(run.lock_time):
        first, second = argrelmin(slip[lane, locked < TIME])[0][:2]
        assert TIME[second - first] == pytest.approx(2 * np.pi / np.sqrt(rigid[lane] / 2e-4), rel=0.06)


def test_play_holds_the_current_at_reversals_and_lags_by_its_width() -> None:
    time, current = play(np.array([[0.0, 1, 2, 3]]), np.array([[0.0, 1, 0, 1]]), 0.2, 0.1)
    samples = np.array([0.1, 0.5, 1, 1.2, 1.6, 2, 2.2, 3])
    np.testing.assert_allclose(np.interp(samples, time[0], current[0]), [0, 0.3, 0.8, 0.8, 0.5, 0.1, 0.1, 0.8])


def test_noise_has_the_specified_std_and_autocorrelation() -> None:
    run, times, signals = generate(Case(noise=0.01, seed=3, count=54))
    assert np.std(times - run.lock_time) == pytest.approx(3e-3, rel=0.3)
    for name, reading in run.readings.items():
        noise = signals[name] - reading
        assert np.std(noise) == pytest.approx(0.01 * np.ptp(reading), rel=0.02)
        assert np.mean(noise[:, 1:] * noise[:, :-1]) / np.var(noise) == pytest.approx(NOISE_MEMORY, abs=0.02)
        assert len(np.unique(signals[name])) < 4500


def test_parameters_scatter_and_drift_as_specified() -> None:
    values = simulate(Case(shift="ten percent", seed=5), relative=1e-4).bench.values
    assert abs(abs(np.mean(values["alpha"]) / 3.2e-4 - 1) - 0.1) < 0.002
    assert np.std(values["aa"]) / np.mean(values["aa"]) == pytest.approx(0.05, rel=0.2)
    assert np.ptp(values["gamma"]) == 0
    run = simulate(Case(drifting=True, seed=5), relative=1e-4)
    in_sequence = run.bench.values["x30"][np.argsort(run.order)]
    assert np.corrcoef(in_sequence[1:], in_sequence[:-1])[0, 1] > 0.7


def test_a_subset_of_the_conditions_has_every_level_about_equally_often() -> None:
    run = simulate(replace(NOMINAL, count=54))
    for factor in (run.bench.motor_speed, run.bench.load_inertia, run.bench.brake_torque, run.conditions // 36):
        counts = np.unique(factor, return_counts=True)[1]
        assert np.ptp(counts) <= 1


def test_files_have_the_layout_of_the_shipped_recordings_and_can_be_opened(tmp_path: Path) -> None:
    case = Case({"friction_falls_with_slip": 0.2}, seed=11, count=20)
    for name in ("one.h5", "two.h5"):
        write(tmp_path / name, case)
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()
    assert layout(tmp_path / "one.h5") == layout(SHIPPED)
    opened = Recordings.open(tmp_path / "one.h5")
    assert opened.signals is not None
    assert opened.run_order is not None
    assert sorted(opened.run_order) == list(range(20))
    write(tmp_path / "times.h5", replace(case, signals=False))
    times = Recordings.open(tmp_path / "times.h5")
    assert times.signals is None
    np.testing.assert_array_equal(times.measured_time, opened.measured_time)


def layout(path: Path) -> dict[str, tuple[str, dict[str, str]]]:
    items = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: items.update({name: (str(getattr(item, "dtype", "")), dict(item.attrs))}))
    return items


def test_the_truth_tabulates_the_changed_quantity() -> None:
    (changed,) = truth(Case({"friction_falls_with_slip": 0.2}, count=20))["changed"]
    grid, ratio = np.array(changed["grid"]), np.array(changed["change"])
    assert (changed["quantity"], changed["abscissa"], changed["kind"]) == ("friction_coefficient", "slip", "ratio")
    np.testing.assert_allclose(ratio, 1 + 0.2 * np.exp(-((grid / 14) ** 1.3)))
    assert sum(changed["visits"]) == pytest.approx(1)
    assert changed["base"] == pytest.approx(3.2e-4, rel=0.1)


def test_a_refit_removes_part_of_a_signature_but_not_all() -> None:
    effects = {"friction_falls_with_slip": 0.2}
    unfitted, fitted = (remaining(effects, count=4, rounds=rounds)["all"] for rounds in (0, 1))
    assert 0.2 < fitted < 0.95 * unfitted
    assert remaining({}, count=4, rounds=0)["all"] == 0
