"""Arithmetic that LLVM can turn into vector instructions: one call to `math.exp` in a loop over lanes stops it."""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit
from numba.extending import register_jitable

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile on first use, for functions that make no arrays: none are counted, and so threads share no counter.

    Division by zero gives inf or NaN: the check for it would stop vectorization.
    """
    return _compile(function, _nrt=False)


def allocating(function: Function, cache: bool = False) -> Function:
    """As `kernel`, for a function that makes arrays."""
    return _compile(function, cache=cache)


def _compile(function: Function, **options: Any) -> Function:
    options |= {"error_model": "numpy", "nogil": True}
    return njit(**options)(function)  # type: ignore[no-any-return]


def compiled(function: Function) -> Function:
    """Let compiled code call `function`, copied into the caller; from Python it stays what it was."""
    return register_jitable(inline="always")(function)


@kernel
def exp(x: float) -> float:
    """e to the power x to a relative 5e-13, held beyond 700: a Taylor polynomial of x/1024, squared ten times."""
    r = min(700.0, max(-700.0, x)) * 0.0009765625
    p = 1.0 + r * (1.0 + r * (1 / 2 + r * (1 / 6 + r * (1 / 24 + r * (1 / 120 + r * (1 / 720 + r * (
        1 / 5040 + r * (1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800 + r / 479001600)))))))))))
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    return p
