"""The compiled entry points, cached on disk under a key that covers the sources of the whole simulator.

The cache key of numba covers only the file that defines a function. Without the additional key, a change of an effect
or a constant in another file would silently run outdated machine code.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from types import CellType, FunctionType

from slipstick.bench import converter
from slipstick.clutch import driver, effects, loading
from slipstick.clutch.fastmath import allocating
from slipstick.numerics import linking, wide_vectors

_SOURCES = [*sorted(Path(__file__).parent.rglob("*.py")), Path(converter.__file__), Path(linking.__file__),
            Path(wide_vectors.__file__)]
_CATALOGUE = " ".join(effect.name for effect in effects.CATALOGUE)
_KEY = hashlib.sha256(b"".join(path.read_bytes() for path in _SOURCES) + _CATALOGUE.encode()).hexdigest()


def _entry_point(function: Callable[..., None]) -> Callable[..., None]:
    """Compile and cache a copy with the key in its closure, which numba's cache index covers.

    A function around it would hold the key too, but numba would optimize and emit the whole simulator once more for it.
    """
    assert isinstance(function, FunctionType)
    code = function.__code__.replace(co_freevars=("key",))
    return allocating(FunctionType(code, function.__globals__, function.__name__, None, (CellType(_KEY),)), cache=True)


drive = _entry_point(driver.drive)
initial_speeds = _entry_point(loading.initial_speeds)
