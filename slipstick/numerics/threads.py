"""Independent parts of the computation in threads: compiled kernels and matrix products release Python's lock."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial, wraps
from itertools import pairwise
from threading import local
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numba import get_num_threads
from threadpoolctl import threadpool_limits

Argument = TypeVar("Argument")
Value = TypeVar("Value")
Given = ParamSpec("Given")

_HERE = local()
"""Whether a thread is one of `mapped`, whose own parts must not start further threads."""


def in_one_blas_thread(function: Callable[Given, Value]) -> Callable[Given, Value]:
    """Decorate a function that multiplies many small matrices, for which threads of the BLAS would only wait."""
    @wraps(function)
    def limited(*args: Given.args, **kwargs: Given.kwargs) -> Value:
        with threadpool_limits(1, "blas"):
            return function(*args, **kwargs)

    return limited


def mapped(function: Callable[[Argument], Value], arguments: Sequence[Argument],
           threads: int | None = None) -> list[Value]:
    """What `function` makes of each of the `arguments`, in their order, by as many threads as compiled kernels may use.

    Or by as many `threads`. In one of these threads it uses no others.
    """
    workers = min(threads or get_num_threads(), len(arguments))
    if workers < 2 or getattr(_HERE, "is_part", False):
        return [function(argument) for argument in arguments]
    with ThreadPoolExecutor(workers, initializer=partial(_be_part, np.geterr())) as pool:
        return list(pool.map(function, arguments))


def parts_of(count: int) -> list[slice]:
    """Slices of `count` rows, as many as compiled kernels may use threads."""
    ends = [count * part // get_num_threads() for part in range(get_num_threads() + 1)]
    return [slice(*bounds) for bounds in pairwise(ends)]


def _be_part(errors: Any) -> None:
    """Mark this thread as a part, which treats floating-point `errors` as its caller does."""
    _HERE.is_part = True
    np.seterr(**errors)
