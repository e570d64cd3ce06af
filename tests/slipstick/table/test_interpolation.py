import itertools

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.sparse import csr_array

from slipstick.errors import InvalidValue, OutsideTable
from slipstick.table.axis import Axis
from slipstick.table.interpolation import interpolate

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
    with pytest.raises(OutsideTable, match=r"Point 1 has axis0 = 0\.2, outside the range of the table, 0\.5 to 1\.5"):
        interpolate(axes, values, points, "error")


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
