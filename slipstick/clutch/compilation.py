"""The compiled entry points, cached on disk under a key that covers the sources of the whole simulator.

The cache key of numba covers only the file that defines a function. Without the additional key, a change of an effect
or a constant in another file would silently run outdated machine code.
"""

from pathlib import Path

from slipstick.bench import converter
from slipstick.clutch import driver, effects, loading
from slipstick.clutch.fastmath import allocating
from slipstick.numerics import linking, wide_vectors

_SOURCES = [*sorted(Path(__file__).parent.rglob("*.py")), Path(converter.__file__), Path(linking.__file__),
            Path(wide_vectors.__file__)]
_CATALOGUE = " ".join(effect.name for effect in effects.CATALOGUE)
_KEY = linking.digest_files(_SOURCES, _CATALOGUE)

drive = allocating(linking.with_key(_KEY, driver.drive), cache=True)
initial_speeds = allocating(linking.with_key(_KEY, loading.initial_speeds), cache=True)
