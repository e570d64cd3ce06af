"""Derivatives of tables compared with differences of their values."""

import numpy as np
import pytest
from test_surrogate_table import random_points
from test_surrogate_table import surrogate as surrogate  # a fixture

from slipstick.errors import OutsideTable
from slipstick.table import Axis, Grid, Table
from tests.benches import HEAVY, NOMINAL

STEP = 1e-4


def grid(d: int) -> Grid:
    names = ("pressure_bias", "initial_position", "friction_coefficient")[:d]
    axes = tuple(Axis(name, np.array([0.5, 0.8, 0.9, 1.2, 1.5])[:5 - position], 1.0, "1")
                 for position, name in enumerate(names))
    shape = (*(len(axis.values) for axis in axes), 3)
    return Grid(axes, np.random.default_rng(d).uniform(0.5, 1.5, shape), np.zeros(shape, np.uint8),
                HEAVY.conditions.take([3, 100, 215]), NOMINAL)


def differences(table: Table, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Jacobian (n, d) and Hessian (n, d, d) by central differences."""
    steps = STEP * np.eye(len(point))

    def at(moved: np.ndarray) -> np.ndarray:
        return table.interpolate(moved[None])[0]

    first = np.column_stack([(at(point + step) - at(point - step)) / (2 * STEP) for step in steps])
    second = np.moveaxis([[(at(point + a + b) - at(point + a - b) - at(point - a + b) + at(point - a - b))
                           / (4 * STEP**2) for b in steps] for a in steps], -1, 0)
    return first, second


@pytest.mark.parametrize("d", [1, 2, 3])
def test_a_grid_has_the_derivatives_of_its_interpolation(d: int) -> None:
    table = grid(d)
    for point in np.random.default_rng(2).uniform(0.82, 0.88, (5, d)):  # inside one cell
        found, (first, second) = table.derivatives(point), differences(table, point)
        np.testing.assert_allclose(found.values, table.interpolate(point[None])[0], rtol=1e-14)
        np.testing.assert_allclose(found.jacobian, first, atol=1e-9)
        np.testing.assert_allclose(found.hessian, second, atol=1e-6)
        assert d == 1 or np.abs(found.hessian).max() > 0.1


def test_a_surrogate_has_the_derivatives_of_its_network(surrogate: Table) -> None:
    for point in random_points(5):
        found, (first, second) = surrogate.derivatives(point), differences(surrogate, point)
        np.testing.assert_allclose(found.values, surrogate.interpolate(point[None])[0], rtol=1e-12)
        np.testing.assert_allclose(found.jacobian, first, atol=1e-5 * np.abs(first).max())
        np.testing.assert_allclose(found.hessian, second, atol=1e-4 * np.abs(second).max())


def test_a_clipped_value_does_not_change_beyond_the_edge(surrogate: Table) -> None:
    for table in (grid(2), surrogate):
        edge, beyond = np.array([table.upper[0], 1.0]), np.array([table.upper[0] + 0.1, 1.0])
        at_edge, outside = table.derivatives(edge), table.derivatives(beyond)
        assert np.array_equal(outside.values, at_edge.values)
        assert not outside.jacobian[:, 0].any()
        assert not outside.hessian[:, 0].any()
        assert np.array_equal(outside.jacobian[:, 1], at_edge.jacobian[:, 1])
        assert at_edge.jacobian[:, 0].all()
        assert np.isnan(table.derivatives(beyond, "nan").jacobian).all()
        with pytest.raises(OutsideTable):
            table.derivatives(beyond, "error")


def test_a_missing_corner_leaves_the_derivatives_that_do_not_use_it() -> None:
    table = grid(2)
    table.times[1, 0, 0], table.status[1, 0, 0] = np.nan, 1
    found = table.derivatives(np.array([0.5, 0.6]))  # on the edge of a cell: only a slope uses the corner
    assert np.isfinite(found.values).all()
    assert np.isnan(found.jacobian[0]).tolist() == [True, False]
    assert np.isfinite(found.jacobian[1:]).all()
