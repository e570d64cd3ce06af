"""Compilation to vector instructions, and an `exp` that allows them: a call to `math.exp` prevents vectorization.

Where a loop divides, the divider of the processor is what it waits for. LLVM divides by a constant that is no power of
two unless it is written as a factor, such as `1 / 6 * x`.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

from numba import njit
from numba.extending import register_jitable

from slipstick.numerics.linking import LINKED
from slipstick.numerics.wide_vectors import WideCompiler

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function, variant: str = "", **options: Any) -> Function:
    """Compile a function without array allocations on first use; it needs no reference counts shared by threads.

    Only compiled functions call it: the wrapper for calls from Python takes as long to compile as a small function, and
    nobody runs machine code of it alone.

    Division by zero gives inf or NaN, because checking for it would prevent vectorization.

    A function that is defined within another one, once for each of some values, needs a `variant` that names them.
    Numba tells such functions apart by a counter of the process only: of two entry points that two processes compiled
    into the cache, one would call functions of the other (numba issue 10486).
    """
    if variant:
        function.__qualname__ += f"[{variant}]"
    return _compile(function, _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True, **LINKED, **options)


def inlined(function: Function, variant: str = "") -> Function:
    """As `kernel`, for what LLVM has to inline: a loop over lanes with a call gives no vector instructions."""
    return kernel(function, variant, forceinline=True)


def allocating(function: Function, cache: bool = False) -> Function:
    """As `kernel`, for a function that allocates arrays or is called from Python."""
    return _compile(function, cache=cache, pipeline_class=WideCompiler)


def _compile(function: Function, **options: Any) -> Function:
    usual: dict[str, Any] = {"error_model": "numpy", "nogil": True, "fastmath": {"contract"}}
    return njit(**usual | options)(function)  # type: ignore[no-any-return]


def inserted(function: Function) -> Function:
    """Insert `function` into its only caller before its types are inferred.

    That compiles faster than a call with many arguments, and slower than `inlined` if there are several calls.
    """
    return _compile(function, inline="always")


def compiled(function: Function) -> Function:
    """Inline `function` in compiled callers; calls from Python stay interpreted."""
    return register_jitable(inline="always")(function)


@partial(_compile, _nrt=False)  # the reference implementation calls it from Python
def exp(x: float) -> float:
    """e^x to a relative error of 5e-13, with |x| clipped at 700: Taylor polynomial of x/1024, squared ten times."""
    r = min(700.0, max(-700.0, x)) * 0.0009765625
    p = 1.0 + r * (1.0 + r * (1 / 2 + r * (1 / 6 + r * (1 / 24 + r * (1 / 120 + r * (1 / 720 + r * (1 / 5040 + r * (
        1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800 + 1 / 479001600 * r)))))))))))
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
