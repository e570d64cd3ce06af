"""Figure data compared with the likelihood, the model and the recordings."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipstick.clutch.ensemble import shifting_times
from slipstick.inference.figures import figure_data
from slipstick.inference.problems import simulated_problem, table_problem
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.table import Grid
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.refine import refined_vector
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, exact
from tests.benches import HEAVY, NOMINAL

SETTINGS = FitSettings(std_bounds=((0.002, 0.08),))
STATE = {"path": [[1.0, 1.0, *np.log([0.01, 0.02, 0.03])], [1.1, 0.9, *np.log([0.02, 0.02, 0.02])]]}
INTERVALS = [{"unknowns": [[1.0 + 0.1 * row, 1.0, 0.02, 0.02, 0.03] for row in range(3)]} for _ in range(6)]
"""Of five unknowns and a combination."""


@pytest.fixture(scope="module")
def problem(small_table: Grid, small_recordings: Recordings) -> InferenceProblem:
    return table_problem(small_table, small_recordings, "clip")


@pytest.fixture(scope="module")
def optimum(problem: InferenceProblem) -> list[float]:
    """The maximum of the likelihood near the true inputs of the recordings."""
    begin = np.array([1.05, 0.95, *np.log([0.01, 0.01, 0.01])])
    return [float(value) for value in refined_vector(problem, search_space(SETTINGS, problem), begin)]


@pytest.fixture(scope="module")
def candidate(problem: InferenceProblem, optimum: list[float]) -> Candidate:
    return search_space(SETTINGS, problem).candidate(np.array(optimum))


@pytest.fixture(scope="module")
def data(problem: InferenceProblem, optimum: list[float], small_recordings: Recordings) -> dict[str, Any]:
    return figure_data(SETTINGS, problem, STATE, {"vector": optimum, "intervals": INTERVALS}, NOMINAL, small_recordings)


def test_figure_data_are_json(data: dict[str, Any], small_recordings: Recordings) -> None:
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert data["conditions"]["motor_speed"] == small_recordings.conditions.motor_speed.tolist()


def test_the_search_is_on_natural_scale_and_has_a_trace_for_each_unknown(data: dict[str, Any]) -> None:
    search = data["search"]
    assert search["unknowns"] == ["mean of pressure_bias", "mean of initial_position", "std of pressure_bias",
                                  "std of initial_position", "output std"]
    np.testing.assert_allclose(search["path"], [[1.0, 1.0, 0.01, 0.02, 0.03], [1.1, 0.9, 0.02, 0.02, 0.02]])
    assert len(search["traces"]) == len(search["unknowns"])  # none for the combination
    assert search["traces"][0][2][0] == 1.2


def test_the_surface_has_its_maximum_near_the_optimum(data: dict[str, Any], candidate: Candidate,
                                                      problem: InferenceProblem) -> None:
    surface = data["surface"]
    assert surface["axes"] == ["pressure_bias", "initial_position"]
    grids, likelihood = (np.array(surface["first"]), np.array(surface["second"])), np.array(surface["log10_likelihood"])
    for grid, low, high in zip(grids, problem.lower, problem.upper, strict=True):
        np.testing.assert_allclose([grid[0], grid[-1]], [low, high])
    first, second = np.unravel_index(np.argmax(likelihood), likelihood.shape)
    at_optimum = exact(problem, candidate).sum()
    # The means compensate for each other. The maximum of the surface may lie anywhere on the ridge of the likelihood.
    assert at_optimum - 0.5 < likelihood.max() < at_optimum + 0.3
    section = [np.interp(candidate.inputs.mean[1], grids[1], row) for row in likelihood]
    assert abs(grids[0][np.argmax(section)] - candidate.inputs.mean[0]) <= np.diff(grids[0]).max()
    moved = replace(candidate.inputs, mean=np.array([grids[0][first], grids[1][second]]))
    assert abs(exact(problem, replace(candidate, inputs=moved)).sum() - likelihood.max()) < 0.3
    assert likelihood.min() < at_optimum - 5


def test_densities_integrate_to_one_with_the_predicted_moments(data: dict[str, Any]) -> None:
    prediction = data["prediction"]
    for times, density, mean, std in zip(*(prediction[name] for name in ("density_time", "density", "mean", "std")),
                                         strict=True):
        t, p = np.array(times), 1e3 * np.array(density)
        assert np.trapezoid(p, t) == pytest.approx(1.0, abs=0.005)
        assert np.trapezoid(p * t, t) == pytest.approx(mean, abs=0.02 * std)
        assert np.sqrt(np.trapezoid(p * (t - mean) ** 2, t)) == pytest.approx(std, rel=0.03)


def test_densities_at_the_measured_times_are_the_likelihood(data: dict[str, Any], problem: InferenceProblem,
                                                            candidate: Candidate) -> None:
    prediction = data["prediction"]
    expected = 10 ** exact(problem, candidate)
    np.testing.assert_array_equal(prediction["measured"], problem.measured_time)
    density = [np.interp(time, *curve) for time, *curve in zip(problem.measured_time, prediction["density_time"],
                                                               prediction["density"], strict=True)]
    np.testing.assert_allclose(density, expected, rtol=0.05)
    np.testing.assert_allclose(prediction["before"], problem.model(np.ones((1, 2)), problem.conditions)[0], rtol=1e-5)


def test_the_engagement_has_the_median_time_and_its_phases_are_in_order(data: dict[str, Any], candidate: Candidate,
                                                                        small_recordings: Recordings) -> None:
    engagement, recorded = data["engagement"], small_recordings.signals
    assert recorded is not None
    condition = engagement["condition"]
    faster = np.count_nonzero(small_recordings.measured_time < small_recordings.measured_time[condition])
    assert faster == len(small_recordings) // 2
    time = np.array(engagement["time"])
    simulated = {name: np.array(values) for name, values in engagement["simulated"].items()}
    assert all(len(values) == len(time) for values in (*simulated.values(), engagement["current"]))
    for name in SIGNAL_UNITS:
        np.testing.assert_allclose(engagement["measured"][name], getattr(recorded, name)[condition], rtol=1e-5)
        # The optimum is on the same ridge of the likelihood as the true inputs, so the signals are nearly equal.
        error = np.abs(simulated[name] - engagement["measured"][name])
        assert np.mean(error) < 0.03 * np.ptp(simulated[name])
    lock = shifting_times(NOMINAL, small_recordings.conditions.take([condition]), ("pressure_bias", "initial_position"),
                          candidate.inputs.mean[None])[0][0, 0]
    assert engagement["lock"] == pytest.approx(lock)
    assert 0 < engagement["touch"] < engagement["lock"] < time[-1]
    # The slip speed is zero after lock-up only.
    slip = simulated["input_speed"] - engagement["gear_ratio"] * simulated["output_speed"]
    assert np.all(np.abs(slip[time > engagement["lock"] + 0.01]) < 0.1)
    assert np.all(np.abs(slip[time < engagement["lock"] - 0.05]) > 1.0)
    # The torque is small before the piston reaches the plates.
    before = time < engagement["touch"]
    assert simulated["piston_position"][before].max() < simulated["piston_position"][~before].min()
    assert simulated["output_torque"][before].max() < 0.2 * simulated["output_torque"].max()


def test_recordings_without_signals_and_one_input(small_recordings: Recordings) -> None:
    """The figure data then contain neither measured signals nor a surface."""
    without_signals = Recordings(small_recordings.conditions, small_recordings.measured_time)
    problem = simulated_problem(NOMINAL, without_signals, ["initial_position"], HEAVY)
    estimate = {"vector": [0.95, np.log(0.03), np.log(0.02)], "intervals": []}
    data = figure_data(SETTINGS, problem, {"path": []}, estimate, NOMINAL, without_signals)
    assert data["surface"] is None
    assert data["engagement"]["measured"] is None
    assert data["engagement"]["lock"] is not None
    assert np.trapezoid(1e3 * np.array(data["prediction"]["density"]), data["prediction"]["density_time"]
                        ) == pytest.approx(1.0, abs=0.005)


def test_times_are_null_for_a_condition_that_never_locks(problem: InferenceProblem, optimum: list[float],
                                                         small_recordings: Recordings) -> None:
    partial = replace(problem, model=lambda points, conditions: np.where(
        np.arange(8) == 2, np.nan, problem.model(points, conditions)))
    estimate = {"vector": optimum, "intervals": []}
    data = figure_data(SETTINGS, partial, STATE, estimate, NOMINAL, small_recordings)
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert data["prediction"]["mean"][2] is None
    assert data["prediction"]["before"][2] is None


def test_of_the_measured_signals_an_engagement_has_those_that_there_are(small_recordings: Recordings) -> None:
    assert small_recordings.signals is not None
    some = replace(small_recordings, signals=replace(small_recordings.signals, pressure=None))
    problem = simulated_problem(NOMINAL, some, ["initial_position"], HEAVY)
    estimate = {"vector": [0.95, np.log(0.03), np.log(0.02)], "intervals": []}
    engagement = figure_data(SETTINGS, problem, {"path": []}, estimate, NOMINAL, some)["engagement"]
    assert list(engagement["measured"]) == [name for name in SIGNAL_UNITS if name != "pressure"]
    assert set(SIGNAL_UNITS) <= set(engagement["simulated"])
