"""Names of compiled functions: machine code that several processes put into the cache is linked by them."""

from collections import Counter
from typing import Any

import pytest
from numba.core.dispatcher import Dispatcher

from slipstick.clutch import compilation
from slipstick.clutch.fastmath import allocating, inlined, kernel
from slipstick.numerics import linking

ENTRY_POINTS: tuple[Any, ...] = (compilation.drive, compilation.initial_speeds)


def reached(start: Dispatcher) -> dict[int, Dispatcher]:
    """All compiled functions that one calls, by identity."""
    found: dict[int, Dispatcher] = {}
    waiting: list[Any] = [start]
    while waiting:
        one = waiting.pop()
        if id(one) in found:
            continue
        found[id(one)] = one
        function = one.py_func
        values = [cell.cell_contents for cell in function.__closure__ or ()]
        values += [function.__globals__[name] for name in function.__code__.co_names if name in function.__globals__]
        values += [getattr(module, name) for module in values if type(module).__name__ == "module"
                   for name in function.__code__.co_names if hasattr(module, name)]
        waiting += [value for value in values if isinstance(value, Dispatcher)]
    return found


def test_no_two_compiled_functions_of_the_simulator_have_the_same_name() -> None:
    functions = {key: one for entry in ENTRY_POINTS for key, one in reached(entry).items()}
    names = Counter(f"{one.py_func.__module__}.{one.py_func.__qualname__}" for one in functions.values())
    assert len(functions) > 60
    assert [name for name, count in names.items() if count > 1] == []


def test_the_cache_of_each_entry_point_covers_all_sources() -> None:
    indices = []
    for entry in ENTRY_POINTS:
        function, index = entry.py_func, entry._cache._index_key
        assert [cell.cell_contents for cell in function.__closure__] == [compilation._KEY]
        before = index(None, entry.targetctx.codegen())
        function.__closure__[0].cell_contents = "another version"
        indices.append((before, index(None, entry.targetctx.codegen())))
        function.__closure__[0].cell_contents = compilation._KEY
    assert all(before != after for before, after in indices)


def test_machine_code_is_made_of_entry_points_only() -> None:
    @inlined
    def inverse(x):  # type: ignore[no-untyped-def]
        if x == 0.0:
            raise ValueError("no inverse")
        return 1.0 / x

    @kernel
    def twice(x):  # type: ignore[no-untyped-def]
        return 2.0 * inverse(x)

    @allocating
    def entry(x):  # type: ignore[no-untyped-def]
        return twice(x) + 1.0

    called: Any = entry
    assert called(4.0) == 1.5
    with pytest.raises(ValueError, match="no inverse"):
        called(0.0)
    libraries = [one.library for function in (inverse, twice, called) for one in function.overloads.values()]
    assert [isinstance(one, linking._Library) for one in libraries] == [True, True, False]
