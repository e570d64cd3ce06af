"""Independent parts of the computation in threads: compiled kernels and matrix products release Python's lock."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from numba import get_num_threads

One = TypeVar("One")
Value = TypeVar("Value")


def mapped(function: Callable[[One], Value], items: Sequence[One], threads: int | None = None) -> list[Value]:
    """What `function` makes of each of the `items`, in their order, by as many threads as compiled kernels may use.

    Or by as many `threads`.
    """
    workers = min(threads or get_num_threads(), len(items))
    if workers < 2:
        return [function(one) for one in items]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(function, items))
