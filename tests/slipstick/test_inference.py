"""Tables and the simulator as problems: what is chosen is uncertain, and the rest is nominal."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from slipstick.bench.conditions import paper_conditions
from slipstick.clutch.ensemble import shifting_times
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, OutsideTable, UnknownName
from slipstick.inference import simulated_problem, table_problem
from slipstick.recordings import Recordings
from slipstick.table import Grid

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
    whole = np.ones((len(POINTS), 2))
    for column, name in enumerate(chosen):
        whole[:, AXES.index(name)] = POINTS[:, column]
    np.testing.assert_array_equal(problem.model(POINTS[:, :len(chosen)], problem.conditions),
                                  small_table.interpolate(whole))
    assert problem.axes == tuple(chosen)
    assert len(problem.lower) == len(problem.upper) == len(problem.knots or ()) == len(chosen)


def test_conditions_are_those_of_the_recordings(small_table: Grid, small_recordings: Recordings) -> None:
    rows = [6, 1]
    few = Recordings(small_recordings.conditions.take(rows), small_recordings.measured_time[rows])
    problem = table_problem(small_table, few, "clip")
    np.testing.assert_array_equal(problem.model(POINTS, problem.conditions), small_table.interpolate(POINTS)[:, rows])
    strange = Recordings(paper_conditions().take([0]), np.array([0.5]))
    with pytest.raises(InvalidValue):
        table_problem(small_table, strange, "clip")


def test_what_holds_beyond_the_table_is_chosen(small_table: Grid, small_recordings: Recordings) -> None:
    beyond, edge = np.array([[1.4, 1.0]]), np.array([[1.3, 1.0]])
    clipped, gap, refused = (table_problem(small_table, small_recordings, outside) for outside in
                             ("clip", "nan", "error"))
    np.testing.assert_array_equal(clipped.model(beyond, clipped.conditions), clipped.model(edge, clipped.conditions))
    assert np.isnan(gap.model(beyond, gap.conditions)).all()
    with pytest.raises(OutsideTable):
        refused.model(beyond, refused.conditions)


def test_a_simulated_problem_is_the_simulator(small_recordings: Recordings) -> None:
    """For parameters that no table holds, in the order they were chosen in, and at their bounds beyond them."""
    chosen = ["film_coefficient", "initial_position", "friction_coefficient"]
    problem = simulated_problem(Model(), small_recordings, chosen)
    assert problem.axes == tuple(chosen)
    assert problem.knots is None
    np.testing.assert_array_equal([problem.lower, problem.upper], [[0.5, 0.1, 0.5], [1.5, 3.0, 1.5]])
    points = np.array([[1.0, 1.0, 1.0], [0.8, 1.4, 1.1], [9.0, 0.0, 1.0]])
    within = np.array([[1.0, 1.0, 1.0], [0.8, 1.4, 1.1], [1.5, 0.1, 1.0]])
    expected = shifting_times(Model(), small_recordings.conditions, chosen, within)[0]
    np.testing.assert_array_equal(problem.model(points, problem.conditions), expected)
    assert len(np.unique(expected[:2, 0])) == 2


@pytest.mark.parametrize(("chosen", "error", "said"), [
    (["presure_bias"], UnknownName, "'presure_bias'.*Did you mean 'pressure_bias'"),
    (["pressure_bias", "mood"], UnknownName, "'mood'"),
    (["pressure_bias", "pressure_bias"], InvalidValue, "each once"),
    ([], InvalidValue, "Name one or more"),
])
def test_inputs_that_are_not_there_are_named(small_table: Grid, small_recordings: Recordings, chosen: Sequence[str],
                                             error: Any, said: str) -> None:
    with pytest.raises(error, match=said):
        table_problem(small_table, small_recordings, "clip", chosen)
    with pytest.raises(error, match=said):
        simulated_problem(Model(), small_recordings, chosen)


def test_a_table_says_that_it_is_the_table_that_lacks_the_axis(small_table: Grid, small_recordings: Recordings) -> None:
    with pytest.raises(UnknownName, match=r"no axis of the table 'film_coefficient'.*initial_position, pressure_bias"):
        table_problem(small_table, small_recordings, "clip", ["film_coefficient"])
    with pytest.raises(UnknownName, match=r"no parameter 'mood'.*film_coefficient"):
        simulated_problem(Model(), small_recordings, ["mood"])
