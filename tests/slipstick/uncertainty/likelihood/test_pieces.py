"""The functions of the compiled integrals over pieces compared with SciPy, and their machine code."""

import platform
import re

import numba
import numpy as np
import pytest
from scipy.special import erfcx

from slipstick.uncertainty.likelihood import pieces
from slipstick.uncertainty.likelihood.exponential import exponential


def test_the_exponential_is_that_of_numpy() -> None:
    x = np.concatenate([np.linspace(-500.0, 0.0, 20001), -np.logspace(-20, 0, 101)])
    np.testing.assert_allclose([exponential(value) for value in x], np.exp(x), rtol=4e-16)
    assert exponential(1e-3) == 1.0
    assert exponential(-1e300) == exponential(np.nan) == exponential(-500.0) > 0


def test_the_mills_ratio_is_that_of_scipy() -> None:
    x = np.concatenate([np.linspace(0.0, 40.0, 4001), np.logspace(-9, 12, 400)])
    ratios = [pieces._mills(pieces._SCALE / (pieces._SCALE + value)) for value in x]
    np.testing.assert_allclose(ratios, np.sqrt(np.pi / 2) * erfcx(x / np.sqrt(2)), rtol=1e-13)


def test_the_coefficients_interpolate_the_mills_ratio() -> None:
    """In the Chebyshev points of the shares -1 to 1, which are then taken to t from 0 to 1."""
    def ratio(share: np.ndarray) -> np.ndarray:
        t = (share + 1) / 2
        return np.sqrt(np.pi / 2) * erfcx(pieces._SCALE * (1 / t - 1) / np.sqrt(2)) / t

    series = np.polynomial.Chebyshev.interpolate(ratio, len(pieces._R) - 1, [-1, 1])
    polynomial = series.convert(kind=np.polynomial.Polynomial)(np.polynomial.Polynomial([-1.0, 2.0]))
    np.testing.assert_allclose(pieces._R, polynomial.coef, rtol=1e-9)


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86 assembly")
@pytest.mark.parametrize("name", ["_place", "_integrate", "_moments", "_differentiate"])
def test_the_loops_are_compiled_to_vector_instructions(name: str) -> None:
    """A loss of vectorization is silent, and costs a factor of about eight."""
    arguments = {"_place": (0.1, 0.6, 0.0, 1e-4), "_integrate": (0.1, 0.6, 1e-4), "_moments": (0.1, 0.6),
                 "_differentiate": (0.1, 0.6, 1.0)}[name]
    function = numba.njit(error_model="numpy", fastmath={"contract"})(getattr(pieces, name).py_func)
    function(np.ones(pieces.WORK), *arguments)
    assert re.search(r"v?mulpd\s", "".join(function.inspect_asm().values()))
