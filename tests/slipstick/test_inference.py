"""Inference problems for tables and the simulator: chosen parameters are uncertain, and the others are nominal."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from slipstick.clutch.ensemble import shifting_times
from slipstick.errors import InvalidValue, OutsideTable, UnknownName
from slipstick.inference import simulated_problem, table_problem
from slipstick.recordings import Recordings
from slipstick.table import Grid
from tests.benches import COMPACT, HEAVY, NOMINAL

AXES = ["pressure_bias", "initial_position"]
POINTS = np.random.default_rng(1).uniform(0.7, 1.3, (7, 2))


def test_all_axes_of_a_table_are_uncertain_by_default(small_table: Grid, small_recordings: Recordings) -> None:
    problem = table_problem(small_table, small_recordings, "clip")
    assert problem.axes == tuple(AXES)
    np.testing.assert_array_equal([problem.lower, problem.upper], [[0.7, 0.7], [1.3, 1.3]])
    np.testing.assert_array_equal(problem.measured_time, small_recordings.measured_time)
    np.testing.assert_array_equal(problem.model(POINTS, problem.conditions), small_table.interpolate(POINTS))
    assert problem.knots is not None
    np.testing.assert_array_equal(problem.knots, [axis.values for axis in small_table.axes])


@pytest.mark.parametrize("chosen", [AXES[:1], AXES[1:], AXES[::-1]], ids=lambda chosen: " ".join(chosen))
def test_axes_that_are_not_chosen_stay_at_nominal(small_table: Grid, small_recordings: Recordings,
                                                  chosen: list[str]) -> None:
    problem = table_problem(small_table, small_recordings, "clip", chosen)
    expected = np.ones((len(POINTS), 2))
    for column, name in enumerate(chosen):
        expected[:, AXES.index(name)] = POINTS[:, column]
    np.testing.assert_array_equal(problem.model(POINTS[:, :len(chosen)], problem.conditions),
                                  small_table.interpolate(expected))
    assert problem.axes == tuple(chosen)
    assert len(problem.lower) == len(problem.upper) == len(problem.knots or ()) == len(chosen)


def test_conditions_are_those_of_the_recordings(small_table: Grid, small_recordings: Recordings) -> None:
    rows = [6, 1]
    subset = Recordings(small_recordings.conditions.take(rows), small_recordings.measured_time[rows])
    problem = table_problem(small_table, subset, "clip")
    np.testing.assert_array_equal(problem.model(POINTS, problem.conditions), small_table.interpolate(POINTS)[:, rows])
    other = Recordings(HEAVY.conditions.take([0]), np.array([0.5]))
    with pytest.raises(InvalidValue):
        table_problem(small_table, other, "clip")


def test_the_policy_outside_the_table_is_applied(small_table: Grid, small_recordings: Recordings) -> None:
    point, edge = np.array([[1.4, 1.0]]), np.array([[1.3, 1.0]])
    clip, nan, error = (table_problem(small_table, small_recordings, outside) for outside in ("clip", "nan", "error"))
    np.testing.assert_array_equal(clip.model(point, clip.conditions), clip.model(edge, clip.conditions))
    assert np.isnan(nan.model(point, nan.conditions)).all()
    with pytest.raises(OutsideTable):
        error.model(point, error.conditions)


def test_a_simulated_problem_agrees_with_the_simulator(small_recordings: Recordings) -> None:
    """Parameters need not be axes of a table, keep the given order, and are clipped at their bounds."""
    chosen = ["film_coefficient", "initial_position", "friction_coefficient"]
    problem = simulated_problem(NOMINAL, small_recordings, chosen, HEAVY)
    assert problem.axes == tuple(chosen)
    assert problem.knots is None
    np.testing.assert_array_equal([problem.lower, problem.upper], [[0.5, 0.1, 0.5], [1.5, 3.0, 1.5]])
    points = np.array([[1.0, 1.0, 1.0], [0.8, 1.4, 1.1], [9.0, 0.0, 1.0]])
    clipped = np.array([[1.0, 1.0, 1.0], [0.8, 1.4, 1.1], [1.5, 0.1, 1.0]])
    expected = shifting_times(NOMINAL, small_recordings.conditions, chosen, clipped)[0]
    np.testing.assert_array_equal(problem.model(points, problem.conditions), expected)
    assert len(np.unique(expected[:2, 0])) == 2


@pytest.mark.parametrize(("chosen", "error", "message"), [
    (["presure_bias"], UnknownName, "'presure_bias'.*Did you mean 'pressure_bias'"),
    (["pressure_bias", "mood"], UnknownName, "'mood'"),
    (["pressure_bias", "pressure_bias"], InvalidValue, "each once"),
    ([], InvalidValue, "Give one or more"),
])
def test_invalid_inputs_raise(small_table: Grid, small_recordings: Recordings, chosen: Sequence[str], error: Any,
                              message: str) -> None:
    with pytest.raises(error, match=message):
        table_problem(small_table, small_recordings, "clip", chosen)
    with pytest.raises(error, match=message):
        simulated_problem(NOMINAL, small_recordings, chosen, HEAVY)


def test_the_error_distinguishes_axes_of_the_table_from_parameters(small_table: Grid,
                                                                   small_recordings: Recordings) -> None:
    with pytest.raises(UnknownName, match=r"no axis of the table 'film_coefficient'.*initial_position, pressure_bias"):
        table_problem(small_table, small_recordings, "clip", ["film_coefficient"])
    with pytest.raises(UnknownName, match=r"no parameter 'mood'.*film_coefficient"):
        simulated_problem(NOMINAL, small_recordings, ["mood"], HEAVY)


def test_bounds_are_those_of_the_bench(small_recordings: Recordings) -> None:
    problem = simulated_problem(NOMINAL, small_recordings, ["initial_position"], HEAVY)
    prior = HEAVY.prior("initial_position")
    assert (problem.lower[0], problem.upper[0]) == (prior.lower, prior.upper)
    with pytest.raises(InvalidValue, match="made for another bench than 'compact'"):
        simulated_problem(NOMINAL, small_recordings, ["initial_position"], COMPACT)
