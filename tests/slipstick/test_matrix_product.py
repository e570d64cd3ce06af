import numpy as np
import pytest

from slipstick.matrix_product import matrix_product

SHAPES = [(1, 1, 1), (3, 5, 2), (4, 4, 4), (7, 9, 33), (8, 3, 1), (9, 45, 216), (0, 3, 2), (2, 0, 3)]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_agrees_with_numpy(shape: tuple[int, int, int], kind: type) -> None:
    m, k, n = shape
    random = np.random.default_rng(1)
    left, right = random.standard_normal((m, k)).astype(kind), random.standard_normal((k, n)).astype(kind)
    product = matrix_product(left, right)
    assert product.dtype == kind
    np.testing.assert_allclose(product, left @ right, rtol=0, atol=1e2 * np.finfo(kind).eps)
    np.testing.assert_array_equal(matrix_product(left, right, np.full((m, n), np.nan, kind)), product)
    np.testing.assert_array_equal(matrix_product(np.asfortranarray(left), right[::-1][::-1]), product)


def test_a_row_does_not_depend_on_the_rows_beside_it() -> None:
    """Otherwise the split of a search among threads would change its result."""
    random = np.random.default_rng(2)
    left, right = random.standard_normal((23, 47)), random.standard_normal((47, 19))
    together = matrix_product(left, right)
    for first in range(4):
        np.testing.assert_array_equal(matrix_product(left[first:], right), together[first:])
    np.testing.assert_array_equal(np.concatenate([matrix_product(row[None], right) for row in left]), together)
