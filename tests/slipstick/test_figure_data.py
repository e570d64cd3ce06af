"""What the pictures show against the likelihood, the model and the recordings it is made of."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipstick.clutch.ensemble import shifting_times
from slipstick.clutch.model import Model
from slipstick.figure_data import figure_data
from slipstick.inference import simulated_problem, table_problem
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.table import Grid
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.refine import refined_vector
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, exact

SETTINGS = FitSettings(std_bounds=((0.002, 0.08),))


@pytest.fixture(scope="module")
def problem(small_table: Grid, small_recordings: Recordings) -> InferenceProblem:
    return table_problem(small_table, small_recordings, "clip")


@pytest.fixture(scope="module")
def found(problem: InferenceProblem) -> list[float]:
    """The maximum of the likelihood next to where the recordings were made."""
    begin = np.array([1.05, 0.95, *np.log([0.01, 0.01, 0.01])])
    return [float(value) for value in refined_vector(problem, search_space(SETTINGS, problem), begin)]


@pytest.fixture(scope="module")
def candidate(problem: InferenceProblem, found: list[float]) -> Candidate:
    return search_space(SETTINGS, problem).candidate(np.array(found))


@pytest.fixture(scope="module")
def shown(problem: InferenceProblem, found: list[float], small_recordings: Recordings) -> dict[str, Any]:
    return figure_data(SETTINGS, problem, found, Model(), small_recordings)


def test_all_of_it_is_json(shown: dict[str, Any], small_recordings: Recordings) -> None:
    assert json.loads(json.dumps(shown, allow_nan=False)) == shown
    assert shown["conditions"]["motor_speed"] == small_recordings.conditions.motor_speed.tolist()


def test_the_surface_peaks_at_the_fit(shown: dict[str, Any], candidate: Candidate, problem: InferenceProblem) -> None:
    surface = shown["surface"]
    assert surface["axes"] == ["pressure_bias", "initial_position"]
    grids, likelihood = (np.array(surface["first"]), np.array(surface["second"])), np.array(surface["log10_likelihood"])
    for grid, low, high in zip(grids, problem.lower, problem.upper, strict=True):
        np.testing.assert_allclose([grid[0], grid[-1]], [low, high])
    place = np.unravel_index(np.argmax(likelihood), likelihood.shape)
    whole = exact(problem, candidate).sum()
    # The two means make up for one another: along that ridge the peak lies somewhere, at the height of the fit.
    assert whole - 0.5 < likelihood.max() < whole + 0.3
    along = [np.interp(candidate.inputs.mean[1], grids[1], row) for row in likelihood]
    assert abs(grids[0][np.argmax(along)] - candidate.inputs.mean[0]) <= np.diff(grids[0]).max()
    moved = replace(candidate.inputs, mean=np.array([grids[0][place[0]], grids[1][place[1]]]))
    assert abs(exact(problem, replace(candidate, inputs=moved)).sum() - likelihood.max()) < 0.3
    assert likelihood.min() < whole - 5


def test_densities_hold_all_but_their_tails(shown: dict[str, Any]) -> None:
    prediction = shown["prediction"]
    for times, density, mean, std in zip(*(prediction[name] for name in ("density_time", "density", "mean", "std")),
                                         strict=True):
        t, p = np.array(times), 1e3 * np.array(density)
        assert np.trapezoid(p, t) == pytest.approx(1.0, abs=0.005)
        assert np.trapezoid(p * t, t) == pytest.approx(mean, abs=0.02 * std)
        assert np.sqrt(np.trapezoid(p * (t - mean) ** 2, t)) == pytest.approx(std, rel=0.03)


def test_densities_are_the_likelihood_of_the_fit(shown: dict[str, Any], problem: InferenceProblem, candidate: Candidate) -> None:
    prediction = shown["prediction"]
    expected = 10 ** exact(problem, candidate)
    np.testing.assert_array_equal(prediction["measured"], problem.measured_time)
    found = [np.interp(time, *curve) for time, *curve in zip(problem.measured_time, prediction["density_time"],
                                                             prediction["density"], strict=True)]
    np.testing.assert_allclose(found, expected, rtol=0.05)
    np.testing.assert_allclose(prediction["before"], problem.model(np.ones((1, 2)), problem.conditions)[0], rtol=1e-5)


def test_the_engagement_is_the_median_one_with_its_phases_in_order(shown: dict[str, Any], candidate: Candidate,
                                                                    small_recordings: Recordings) -> None:
    engagement, recorded = shown["engagement"], small_recordings.signals
    assert recorded is not None
    condition = engagement["condition"]
    faster = np.count_nonzero(small_recordings.measured_time < small_recordings.measured_time[condition])
    assert faster == len(small_recordings) // 2
    time = np.array(engagement["time"])
    simulated = {name: np.array(values) for name, values in engagement["simulated"].items()}
    assert all(len(values) == len(time) for values in (*simulated.values(), engagement["current"]))
    for name in SIGNAL_UNITS:
        np.testing.assert_allclose(engagement["measured"][name], getattr(recorded, name)[condition], rtol=1e-5)
        # The fit lies on the ridge through the truth of the recordings: its signals are nearly the same.
        away = np.abs(simulated[name] - engagement["measured"][name])
        assert np.mean(away) < 0.03 * np.ptp(simulated[name])
    lock = shifting_times(Model(), small_recordings.conditions.take([condition]), ("pressure_bias", "initial_position"),
                          candidate.inputs.mean[None])[0][0, 0]
    assert engagement["lock"] == pytest.approx(lock)
    assert 0 < engagement["touch"] < engagement["lock"] < time[-1]
    # Locked, the output turns with the input through the gear; before, it does not.
    slip = simulated["input_speed"] - engagement["gear_ratio"] * simulated["output_speed"]
    assert np.all(np.abs(slip[time > engagement["lock"] + 0.01]) < 0.1)
    assert np.all(np.abs(slip[time < engagement["lock"] - 0.05]) > 1.0)
    # Torque starts where the piston gets to the plates, and not before.
    before = time < engagement["touch"]
    assert simulated["piston_position"][before].max() < simulated["piston_position"][~before].min()
    assert simulated["output_torque"][before].max() < 0.2 * simulated["output_torque"].max()


def test_recordings_without_signals_and_one_input(small_recordings: Recordings) -> None:
    """Nothing is measured then but times, and one mean has no surface."""
    bare = Recordings(small_recordings.conditions, small_recordings.measured_time)
    problem = simulated_problem(Model(), bare, ["initial_position"])
    shown = figure_data(SETTINGS, problem, [0.95, np.log(0.03), np.log(0.02)], Model(), bare)
    assert shown["surface"] is None
    assert shown["engagement"]["measured"] is None
    assert shown["engagement"]["lock"] is not None
    assert np.trapezoid(1e3 * np.array(shown["prediction"]["density"]), shown["prediction"]["density_time"]
                        ) == pytest.approx(1.0, abs=0.005)


def test_what_never_locks_is_a_gap(problem: InferenceProblem, found: list[float], small_recordings: Recordings) -> None:
    holed = replace(problem, model=lambda points, conditions: np.where(
        np.arange(8) == 2, np.nan, problem.model(points, conditions)))
    shown = figure_data(SETTINGS, holed, found, Model(), small_recordings)
    assert json.loads(json.dumps(shown, allow_nan=False)) == shown
    assert shown["prediction"]["mean"][2] is None
    assert shown["prediction"]["before"][2] is None
