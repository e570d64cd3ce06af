"""The compiled entry points, cached on disk under a key that covers the sources of the whole simulator.

The cache key of numba covers only the file that defines a function. Without the additional key, a change of an effect
or a constant in another file would silently run outdated machine code.
"""

import hashlib
from pathlib import Path

from slipstick.bench import converter
from slipstick.clutch import driver, effects, loading
from slipstick.clutch.fastmath import allocating

_SOURCES = [*sorted(Path(__file__).parent.rglob("*.py")), Path(converter.__file__)]
_CATALOGUE = " ".join(effect.name for effect in effects.CATALOGUE)
_KEY = hashlib.sha256(b"".join(path.read_bytes() for path in _SOURCES) + _CATALOGUE.encode()).hexdigest()


def _entry_points(key):
    def drive(*arguments):
        key  # noqa: B018 - makes the key part of the closure, and so of numba's cache index
        driver.drive(*arguments)

    def observe(*arguments):
        key  # noqa: B018
        driver.observe(*arguments)

    def initial_speeds(*arguments):
        key  # noqa: B018
        loading.initial_speeds(*arguments)

    return allocating(drive, cache=True), allocating(observe, cache=True), allocating(initial_speeds, cache=True)


drive, observe, initial_speeds = _entry_points(_KEY)
