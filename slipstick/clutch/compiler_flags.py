"""Comparison of numba's compiler flags in less time.

Numba looks up an implementation of an operator, such as an access to an array, under a key that contains all flags of
the function, and asks some fifty templates per access. To compare flags it reads about 25 properties of each. That took
a sixth of the time of the compilation of the simulator; the same dictionary from its parts takes nearly none.
"""

from typing import Any

from numba.core.compiler import Flags

_flags: Any = Flags
_defaults = {name: option.default for name, option in _flags.options.items()}


def _values(flags: Any) -> dict[str, Any]:
    return {**_defaults, **flags._values}


def compare_fast() -> None:
    """Replace the method of numba, unless it represents flags in another way."""
    flags = _flags()
    flags.nrt = not flags.nrt
    if getattr(flags, "_values", None) == {"nrt": flags.nrt} and flags.values() == _values(flags):
        _flags.values = _values
