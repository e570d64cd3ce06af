"""Inference problems for tables and the simulator: chosen parameters are uncertain, and the others are nominal."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipstick.black_box import BlackBoxDescription, Cases, Input, Measurements, Quantity
from slipstick.clutch.ensemble import shifting_times
from slipstick.errors import InvalidValue, OutsideTable, UnknownName
from slipstick.inference.problems import require_reach, simulated_problem, table_problem
from slipstick.recordings import Recordings
from slipstick.table import Axis, Grid
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import InferenceProblem
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


def test_an_axis_that_is_not_chosen_has_its_nominal_value_in_the_table(small_table: Grid,
                                                                       small_recordings: Recordings) -> None:
    first, second = small_table.axes
    beyond = replace(small_table, axes=(first, replace(second, values=second.values + 1.0)))
    with pytest.raises(InvalidValue, match=r"initial_position is no uncertain input, .* goes from 1\.7 to 2\.3\. Fit"):
        table_problem(beyond, small_recordings, "clip", AXES[:1])
    assert table_problem(beyond, small_recordings, "clip").axes == tuple(AXES)


def test_conditions_are_those_of_the_recordings(small_table: Grid, small_recordings: Recordings) -> None:
    rows = [6, 1]
    subset = Recordings(small_recordings.conditions.take(rows), small_recordings.measured_time[rows])
    problem = table_problem(small_table, subset, "clip")
    np.testing.assert_array_equal(problem.model(POINTS, problem.conditions), small_table.interpolate(POINTS)[:, rows])
    other = Recordings(HEAVY.conditions.take([0]), np.array([0.5]))
    with pytest.raises(InvalidValue):
        table_problem(small_table, other, "clip")


def test_recordings_of_a_clutch_are_refused_for_the_table_of_another_machine(small_recordings: Recordings) -> None:
    cases = Cases((Quantity("load", "N"),), np.ones((1, 1)))
    machine = BlackBoxDescription("beam", (Input("size", "m", 0.1, 0.5, 1.5),), cases.quantities,
                                  Quantity("stress", "Pa"), "")
    table = Grid((Axis("size", np.array([0.5, 1.5]), 0.1, "m"),), np.ones((2, 1)), np.zeros((2, 1), np.uint8), cases,
                 machine)
    with pytest.raises(InvalidValue, match=r"shifting times of a clutch, and the table is of stress \[Pa\]"):
        table_problem(table, small_recordings, "clip")


def stress_problem(measured: np.ndarray) -> InferenceProblem:
    """The problem of measured stresses in Pa, one under each of n loads."""
    quantity = Quantity("stress", "Pa")
    cases = Cases((Quantity("load", "N"),), np.arange(1.0, len(measured) + 1)[:, None])
    machine = BlackBoxDescription("beam", (Input("size", "m", 0.1, 0.5, 1.5),), cases.quantities, quantity, "")
    values = np.array([[0.5], [1.5]]) * cases.values.T * 1e8
    axes = (Axis("size", np.array([0.5, 1.5]), 0.1, "m"),)
    table = Grid(axes, values, np.zeros(values.shape, np.uint8), cases, machine)
    return table_problem(table, Measurements(cases, measured, quantity, ""), "clip")


@pytest.mark.parametrize(("measured", "largest"), [
    ([1e8, 2e8, 4e8], 1.5e8), ([300.0, 301.0, 299.0], 1.0), ([2e-12, 6e-12], 2e-12),  # half of the range
    ([4e8, 4e8, 4e8 * (1 + 1e-15)], 2e8), ([-5.0, -5.0], 2.5), ([0.0, 0.0], 0.5)])  # there is no range
def test_the_bounds_of_the_noise_follow_from_the_measurements(measured: list[float], largest: float) -> None:
    problem = stress_problem(np.array(measured))
    assert problem.unit == "Pa"
    np.testing.assert_allclose(problem.output_std_bounds, [1e-3 * largest, largest], rtol=1e-9)
    space = search_space(FitSettings(), problem)
    np.testing.assert_allclose(np.exp([space.lower[-1], space.upper[-1]]), problem.output_std_bounds)
    given = search_space(FitSettings(output_std_bounds=(0.5 * largest, 3 * largest)), problem)
    np.testing.assert_allclose(np.exp([given.lower[-1], given.upper[-1]]), [0.5 * largest, 3 * largest])


def test_the_bounds_of_the_noise_of_a_clutch_are_those_of_its_sensors(small_table: Grid,
                                                                      small_recordings: Recordings) -> None:
    for problem in (table_problem(small_table, small_recordings, "clip"),
                    simulated_problem(NOMINAL, small_recordings, AXES, HEAVY)):
        assert (problem.unit, problem.output_std_bounds) == ("s", (0.0005, 0.1))


def test_a_noise_below_the_rounding_errors_is_refused_in_the_unit_of_the_output() -> None:
    problem = stress_problem(np.array([1e8, 2e8, 4e8]))
    problem.require_output_std(5e6)
    problem.require_output_std(4e-6)
    with pytest.raises(InvalidValue, match=r"The output std is 1e-07 Pa.*such as 4e-06 Pa"):
        problem.require_output_std(1e-7)
    with pytest.raises(InvalidValue, match="1e-08 Pa"):
        search_space(FitSettings(output_std_bounds=(1e-8, 1e8)), problem)


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


def made_problem(outputs: np.ndarray, measured: np.ndarray, upper: float = 2.0) -> InferenceProblem:
    """A model whose outputs (n,) are multiplied by both of its inputs, from 0.5 to `upper`."""
    return InferenceProblem(lambda points, conditions: points.prod(axis=1)[:, None] * outputs, None, measured,
                            np.full(2, 0.5), np.full(2, upper), ("gain", "size"))


OUTPUT, OUTPUTS = Quantity("deflection", "mm"), np.linspace(-3, 12, 31)


@pytest.mark.parametrize("factor", [0.1, 1.0, -1.0, 10.0])
def test_measurements_that_some_inputs_reach_may_be_fitted(factor: float) -> None:
    require_reach(made_problem(OUTPUTS, factor * OUTPUTS), OUTPUT)
    require_reach(made_problem(OUTPUTS, 100 * factor * OUTPUTS, upper=30), OUTPUT)


@pytest.mark.parametrize("factor", [1e3, -1e3, 20.0, 0.05, 1e-3])
def test_measurements_in_another_unit_or_of_another_machine_are_refused(factor: float) -> None:
    with pytest.raises(InvalidValue, match=r"The measured deflection is .* mm in the median of 31 conditions, and "
                                           r"still .* times that of the model at the bounds of gain, size\. Check"):
        require_reach(made_problem(OUTPUTS, factor * OUTPUTS), OUTPUT)


def test_neither_a_few_flawed_measurements_nor_many_about_zero_are_a_reason() -> None:
    flawed = OUTPUTS.copy()
    flawed[:10] = 1e6
    require_reach(made_problem(OUTPUTS, flawed), OUTPUT)
    pulse = np.where(np.arange(31) < 6, 1.0, 1e-6)
    require_reach(made_problem(pulse, pulse + 0.01 * np.random.default_rng(1).standard_normal(31)), OUTPUT)


def test_times_in_another_unit_are_refused_and_those_of_a_table_and_a_simulator_are_not(
        small_table: Grid, small_recordings: Recordings) -> None:
    for problem in (table_problem(small_table, small_recordings, "error"),
                    simulated_problem(NOMINAL, small_recordings, AXES, HEAVY)):
        require_reach(problem, small_table.output)
        for factor in (1e-3, 1e3):
            with pytest.raises(InvalidValue, match=r"shifting time is .* s in the median of 8 conditions"):
                require_reach(replace(problem, measured_time=factor * problem.measured_time), small_table.output)


def test_a_model_that_is_undefined_under_most_conditions_is_refused() -> None:
    with pytest.raises(InvalidValue, match="still 0 times"):
        require_reach(made_problem(np.where(np.arange(31) < 3, OUTPUTS, np.nan), OUTPUTS), OUTPUT)
