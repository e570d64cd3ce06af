"""Names of compiled functions: machine code that several processes put into the cache is linked by them."""

from collections import Counter
from typing import Any

from numba.core.dispatcher import Dispatcher

from slipstick.clutch import compilation


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
    functions = {key: one for entry in (compilation.drive, compilation.observe, compilation.initial_speeds)
                 for key, one in reached(entry).items()}
    names = Counter(f"{one.py_func.__module__}.{one.py_func.__qualname__}" for one in functions.values())
    assert len(functions) > 60
    assert [name for name, count in names.items() if count > 1] == []
