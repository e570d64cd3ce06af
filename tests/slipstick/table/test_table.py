"""Tables as values: digests, interpolation against SciPy, and derivatives against differences."""

import itertools
import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.sparse import csr_array
from test_surrogate_table import random_points
from test_surrogate_table import surrogate as surrogate  # a fixture

from slipstick.errors import InvalidValue, OutsideTable
from slipstick.table import Axis, Grid, Table
from slipstick.table.interpolation import interpolate
from slipstick.table.points import count_outside
from tests.benches import HEAVY, NOMINAL


def test_conditions_are_matched_by_value(table):
    points = np.random.default_rng(2).uniform(0.6, 1.4, (20, 2))
    times = table.interpolate(points)
    paper = HEAVY.conditions
    assert np.array_equal(table(points, table.conditions), times)
    assert np.array_equal(table(points, paper.take([215, 3])), times[:, [2, 0]])
    rounded = replace(paper.take([100]), motor_speed=paper.motor_speed[[100]] * (1 + 1e-13))
    assert np.array_equal(table(points, rounded), times[:, [1]])


def test_unknown_conditions_are_rejected(table):
    paper = HEAVY.conditions
    for other in (paper.take([3, 4]), replace(paper.take([100, 3]), profile_current=paper.profile_current * 1.001)):
        with pytest.raises(InvalidValue, match="is not in the table"):
            table(np.ones((1, 2)), other)


def test_points_outside_are_clipped_when_the_table_is_called(table):
    assert np.array_equal(table(np.array([[0.1, 1.0]]), table.conditions), table.interpolate(np.array([[0.5, 1.0]])))
    assert (table.lower.tolist(), table.upper.tolist()) == ([0.5, 0.5], [1.5, 1.5])


def test_the_digest_depends_on_the_content_only(table):
    axes, times, status = table.axes, table.times, table.status
    faster = replace(table.conditions, motor_speed=table.conditions.motor_speed * 1.01)
    later = times.copy()
    later[3, 3, 1] = np.nextafter(later[3, 3, 1], 2)
    failed = np.where(status == 1, 2, status).astype(np.uint8)
    others = [
        Grid(axes, later, status, table.conditions, table.model),
        Grid(axes, times, failed, table.conditions, table.model),
        Grid(axes, times, status, faster, table.model),
        Grid(axes, times, status, table.conditions, NOMINAL.with_parameters({"gear_ratio": 3.0})),
        *(Grid((replace(axes[0], **change), axes[1]), times, status, table.conditions, table.model)
          for change in ({"name": "gear_ratio"}, {"nominal": 1.7}, {"unit": "Pa"},
                         {"values": axes[0].values + 0.01})),
    ]
    assert len({table.digest, *(other.digest for other in others)}) == len(others) + 1
    assert Grid(axes, times.copy(), status, table.conditions, NOMINAL, "another origin").digest == table.digest


def test_the_run_order_matters_only_if_an_effect_depends_on_it(table, tmp_path):
    drifting = NOMINAL.with_effect("temperature_drift", {"drift": 0.02})
    ordered, other = (replace(table.conditions, run_order=np.array(order)) for order in ([2, 0, 1], [0, 2, 1]))
    constant, drift = replace(table, conditions=ordered), replace(table, conditions=ordered, model=drifting)
    assert constant.digest == table.digest
    assert drift.digest != replace(drift, conditions=other).digest
    points = np.ones((1, 2))
    for name, written in (("constant.h5", constant), ("drift.h5", drift)):
        written.save(tmp_path / name)
        read = Grid.open(tmp_path / name)
        assert read.digest == written.digest
        assert np.array_equal(read(points, ordered.take([1, 2])), written.interpolate(points)[:, 1:], equal_nan=True)
    assert Grid.open(tmp_path / "constant.h5").conditions.run_order is None
    assert np.array_equal(constant(points, other), constant.interpolate(points), equal_nan=True)
    for unknown in (other, table.conditions):
        with pytest.raises(InvalidValue, match="not in the table at its position in the run order"):
            drift(points, unknown)


def test_inconsistent_fields_are_rejected(table):
    locked = np.zeros_like(table.status)
    for change, message in [({"status": locked}, "contradict"), ({"status": table.status + 3}, "contradict"),
                            ({"times": table.times[:-1]}, "not float64"), ({"axes": table.axes[:1] * 2}, "axes"),
                            ({"times": table.times.astype("f4")}, "float32")]:
        with pytest.raises(InvalidValue, match=message):
            replace(table, **change)
    for values in ([1.0], [1.0, 1.0], [1.0, np.nan], [2.0, 1.0]):
        with pytest.raises(InvalidValue, match="pressure_bias"):
            Axis("pressure_bias", np.array(values), 1.6, "bar")


def test_can_be_pickled(table):
    table(np.ones((1, 2)), table.conditions.take([1]))
    assert pickle.loads(pickle.dumps(table)).digest == table.digest


GRIDS = [np.array([0.5, 0.6, 1.1, 1.5]), np.linspace(0.7, 1.3, 6), np.array([0.9, 1.0, 1.4]),
         np.array([1.0, 2.0])]


def by_sparse_matrix(axes, values, points):
    """The same sums as a product of a sparse matrix of corner weights with the table."""
    corner, weight = np.zeros((len(points), 1), dtype=np.int64), np.ones((len(points), 1))
    for axis, x in zip(axes, points.T, strict=True):
        grid = axis.values
        cell = np.clip(np.searchsorted(grid, x, side="right") - 1, 0, len(grid) - 2)
        fraction = (x - grid[cell]) / (grid[cell + 1] - grid[cell])
        corner = ((corner * len(grid))[:, :, None] + np.stack([cell, cell + 1], axis=1)[:, None]).reshape(len(x), -1)
        weight = (weight[:, :, None] * np.stack([1 - fraction, fraction], axis=1)[:, None]).reshape(len(x), -1)
    rows = values.reshape(-1, values.shape[-1])
    matrix = csr_array((weight.ravel(), corner.ravel(), np.arange(len(points) + 1) * 2 ** len(axes)),
                       shape=(len(points), len(rows)))
    matrix.eliminate_zeros()
    return matrix @ rows


def case(dimension, outputs=4):
    axes = [Axis(f"axis{i}", grid, 1.0, "1") for i, grid in enumerate(GRIDS[:dimension])]
    shape = (*(len(axis.values) for axis in axes), outputs)
    return axes, np.random.default_rng(dimension).uniform(0.5, 1.5, shape)


def inside(axes, count, seed=0):
    low, high = [axis.lower for axis in axes], [axis.upper for axis in axes]
    return np.random.default_rng(seed).uniform(low, high, (count, len(axes)))


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_agrees_with_scipy(dimension):
    axes, values = case(dimension)
    points = inside(axes, 500)
    reference = RegularGridInterpolator([axis.values for axis in axes], values)(points)
    np.testing.assert_allclose(interpolate(axes, values, points, "error"), reference, rtol=0, atol=1e-14)


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
@pytest.mark.parametrize("outputs", [1, 7, 216])
def test_the_compiled_loop_is_bit_identical_to_a_sparse_matrix(dimension, outputs):
    """Also where weights are 0, at grid values of some axes, and where corners are NaN."""
    axes, values = case(dimension, outputs)
    values[np.random.default_rng(7).uniform(size=values.shape) < 0.02] = np.nan
    points = inside(axes, 200)
    for column, axis in enumerate(axes):
        points[column::5, column] = np.random.default_rng(column).choice(axis.values, len(points[column::5]))
    interpolated = interpolate(axes, values, points, "error")
    np.testing.assert_array_equal(interpolated, by_sparse_matrix(axes, values, points))
    np.testing.assert_array_equal(interpolate(axes, np.asfortranarray(values), points[::-1], "error"),
                                  interpolated[::-1])


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_values_at_grid_points_are_reproduced_bit_for_bit(dimension):
    axes, values = case(dimension)
    points = np.array(list(itertools.product(*(axis.values for axis in axes))))
    assert np.array_equal(interpolate(axes, values, points, "error"), values.reshape(len(points), -1))


def test_a_nan_corner_affects_only_points_at_which_its_weight_is_not_zero():
    axes, values = case(2)
    values[1, 2, 0] = np.nan
    a, b = axes[0].values, axes[1].values
    affected = [[(a[1] + a[2]) / 2, (b[2] + b[3]) / 2], [(a[0] + a[1]) / 2, b[2]], [a[1], b[2]]]
    unaffected = [[a[0], (b[1] + b[2]) / 2], [(a[0] + a[1]) / 2, b[1]], [a[2], (b[2] + b[3]) / 2]]
    interpolated = interpolate(axes, values, np.array(affected + unaffected), "error")
    assert np.isnan(interpolated[:, 0]).tolist() == [True] * 3 + [False] * 3
    assert np.isfinite(interpolated[:, 1:]).all()


def test_a_point_outside_is_an_error_clipped_or_nan():
    axes, values = case(2)
    points = np.array([[1.0, 1.0], [0.2, 1.0], [1.0, 1.7], [9.0, -9.0]])
    edge = np.array([[1.0, 1.0], [0.5, 1.0], [1.0, 1.3], [1.5, 0.7]])
    clipped = interpolate(axes, values, points, "clip")
    assert np.array_equal(clipped, interpolate(axes, values, edge, "error"))
    masked = interpolate(axes, values, points, "nan")
    assert np.isnan(masked[1:]).all()
    assert np.array_equal(masked[0], clipped[0])
    with pytest.raises(OutsideTable, match=r"Point 1 has axis0 = 0\.2, outside the range of the table, 0\.5 to 1\.5"
                       ) as caught:
        interpolate(axes, values, points, "error")
    assert "`outside` to `clip`" in caught.value.remedy
    assert count_outside(axes, points) == 3


@pytest.mark.parametrize("edges", [(0.5, 1.5), (0.0, 1e6), (-3e-9, 0.0)])
def test_a_point_outside_by_rounding_is_inside(edges: tuple[float, float]) -> None:
    axes, (low, high) = (Axis("a", np.array(edges), 1.0, "1"),), edges
    values, size = np.array([[2.0], [3.0]]), max(map(abs, edges))
    rounded = np.array([[low - 1e-13 * size], [high + 1e-13 * size], [np.nextafter(high, np.inf)]])
    for policy in ("error", "clip", "nan"):
        assert interpolate(axes, values, rounded, policy).ravel().tolist() == [2.0, 3.0, 3.0]
    assert count_outside(axes, rounded) == 0
    for beyond in (low - 1e-11 * size, high + 1e-11 * size):
        assert count_outside(axes, np.array([[beyond]])) == 1
        with pytest.raises(OutsideTable):
            interpolate(axes, values, np.array([[beyond]]), "error")


@pytest.mark.parametrize(("points", "message"), [
    (np.ones((3, 1)), r"not \(m, 2\)"), (np.ones(2), r"not \(m, 2\)"),
    (np.array([[1.0, 1.0], [1.0, np.nan]]), "Point 1 is not finite in axis1"),
    (np.array([[np.inf, 1.0]]), "Point 0 is not finite in axis0"),
])
def test_invalid_points_are_rejected(points, message):
    axes, values = case(2)
    with pytest.raises(InvalidValue, match=message):
        interpolate(axes, values, points, "clip")


def test_no_points_give_no_rows():
    axes, values = case(2)
    assert interpolate(axes, values, np.empty((0, 2)), "error").shape == (0, 4)


# Derivatives of tables compared with differences of their values.


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
        rounded = table.derivatives(np.array([np.nextafter(table.upper[0], 9.0), 1.0]), "nan")
        assert np.array_equal(rounded.jacobian, at_edge.jacobian)
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
