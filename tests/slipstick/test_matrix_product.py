import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from slipstick.matrix_product import matrix_product

SHAPES = [(1, 1, 1), (3, 5, 2), (4, 4, 4), (7, 9, 33), (8, 3, 1), (8, 1, 24), (9, 45, 216), (16, 5, 48), (31, 7, 23),
          (33, 2, 97), (0, 3, 2), (2, 0, 3), (12, 0, 60), (12, 4, 0)]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_agrees_with_numpy(shape: tuple[int, int, int], kind: type) -> None:
    m, k, n = shape
    random = np.random.default_rng(1)
    left, right = random.standard_normal((m, k)).astype(kind), random.standard_normal((k, n)).astype(kind)
    product = matrix_product(left, right)
    assert product.dtype == kind
    np.testing.assert_allclose(product, left @ right, rtol=0, atol=1e2 * np.finfo(kind).eps)
    np.testing.assert_array_equal(matrix_product(np.asfortranarray(left), right[::-1][::-1]), product)


@pytest.mark.parametrize("n", [19, 101])
def test_a_row_does_not_depend_on_the_rows_beside_it(n: int) -> None:
    """Otherwise the split of a search among threads would change its result."""
    random = np.random.default_rng(2)
    left, right = random.standard_normal((23, 47)), random.standard_normal((47, n))
    together = matrix_product(left, right)
    for first in range(4):
        np.testing.assert_array_equal(matrix_product(left[first:], right), together[first:])
    np.testing.assert_array_equal(np.concatenate([matrix_product(row[None], right) for row in left]), together)


def test_every_entry_is_one_sum_in_the_order_of_the_inner_index() -> None:
    """Also where tiles overlap: terms that cancel each other leave what another order would lose."""
    left = np.tile([1e16, 1.0, -1e16, 1.0], (13, 1))
    np.testing.assert_array_equal(matrix_product(left, np.ones((4, 53))), 1.0)
    np.testing.assert_array_equal(matrix_product(left[:, [0, 2, 1, 3]], np.ones((4, 53))), 2.0)


@pytest.mark.parametrize("features", [{}, {"avx": True}])
def test_does_not_depend_on_the_width_of_the_vectors(features: dict[str, bool], tmp_path: Path) -> None:
    """Tiles of other processors compute the same sums."""
    random = np.random.default_rng(3)
    left, right = random.standard_normal((23, 47)), random.standard_normal((47, 101))
    np.savez(tmp_path / "factors.npz", left=left, right=right)
    code = f"""if True:
        import numba
        import numpy as np
        from llvmlite import binding
        numba.njit(lambda: None)()  # after which numba has read the features itself
        binding.get_host_cpu_features = lambda: {features}
        from slipstick.matrix_product import matrix_product
        factors = np.load("factors.npz")
        np.save("product.npy", matrix_product(factors["left"], factors["right"]))
    """
    root = str(Path(__file__).parents[2])
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True,
                   env={**os.environ, "PYTHONPATH": root, "NUMBA_CACHE_DIR": str(tmp_path)})
    np.testing.assert_array_equal(np.load(tmp_path / "product.npy"), matrix_product(left, right))
