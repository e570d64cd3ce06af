"""Products of matrices and loops with vectors of a stated width."""

import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from llvmlite import binding

from slipstick.numerics import wide_vectors
from slipstick.numerics.matrix_product import matrix_product
from slipstick.numerics.wide_vectors import WideCompiler

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


@pytest.mark.slow
def test_does_not_depend_on_the_width_of_the_vectors(tmp_path: Path) -> None:
    """Tiles of other processors compute the same sums: here of one without AVX."""
    random = np.random.default_rng(3)
    left, right = random.standard_normal((23, 47)), random.standard_normal((47, 101))
    np.savez(tmp_path / "factors.npz", left=left, right=right)
    code = """if True:
        import numba
        import numpy as np
        from llvmlite import binding
        numba.njit(lambda: None)()  # after which numba has read the features itself
        binding.get_host_cpu_features = lambda: {}
        from slipstick.numerics.matrix_product import matrix_product
        factors = np.load("factors.npz")
        np.save("product.npy", matrix_product(factors["left"], factors["right"]))
    """
    root = str(Path(__file__).parents[3])
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True,
                   env={**os.environ, "PYTHONPATH": root, "NUMBA_CACHE_DIR": str(tmp_path)})
    np.testing.assert_array_equal(np.load(tmp_path / "product.npy"), matrix_product(left, right))


def scaled(values: np.ndarray, result: np.ndarray) -> None:
    for i in range(len(values)):
        result[i] = 3.0 * values[i] * values[i] + 1.0


def machine_code(**options: object) -> tuple[str, np.ndarray]:
    compiled = numba.njit(**options)(scaled)
    result = np.empty(1001)
    compiled(np.arange(1001.0), result)
    return "".join(compiled.inspect_asm().values()), result


def test_results_are_those_of_usual_code() -> None:
    assert np.array_equal(machine_code(pipeline_class=WideCompiler)[1], 3.0 * np.arange(1001.0)**2 + 1.0)


@pytest.mark.skipif(not binding.get_host_cpu_features().get("avx512f"), reason="this processor has no AVX-512")
@pytest.mark.parametrize("width", ["512", "256"])
def test_loops_use_vectors_of_the_stated_width(width: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert '"512"' in wide_vectors._WIDTH
    monkeypatch.setattr(wide_vectors, "_WIDTH", wide_vectors._WIDTH.replace("512", width))
    assert ("zmm" in machine_code(pipeline_class=WideCompiler)[0]) == (width == "512")
