"""The exponential function in a form that compilers turn into vector instructions, unlike that of a library."""

import numba
import numpy as np

_LEAST = -500.0  # smaller arguments are raised to it, so that products with the result are not subnormal, which is slow
_LOG2_E, _LN2_HIGH, _LN2_LOW = 1.4426950408889634, 0.693147180369123816490, 1.90821492927058770002e-10
_TO_INTEGER = 1.5 * 2**52  # added to a number, it leaves the nearest integer in the last bits


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def exponential(x: float) -> float:
    """exp(x) up to rounding for x from -500 to 0, and at the nearer of the two for any other x; exp(-500) for NaN.

    x is n ln 2 + r with an integer n. exp(r) is its Taylor polynomial, and 2^n is assembled from its bits.
    """
    x = x if x > _LEAST else _LEAST
    x = x if x < 0.0 else 0.0
    shifted = x * _LOG2_E + _TO_INTEGER
    n = shifted - _TO_INTEGER
    r = (x - n * _LN2_HIGH) - n * _LN2_LOW
    p = 1 + r * (1 + r * (1 / 2 + r * (1 / 6 + r * (1 / 24 + r * (1 / 120 + r * (1 / 720 + r * (1 / 5040 + r * (
        1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800 + 1 / 479001600 * r)))))))))))
    bits = np.int64((np.int64(np.float64(shifted).view(np.int64)) + 1023) << 52)
    return p * np.float64(bits.view(np.float64))
