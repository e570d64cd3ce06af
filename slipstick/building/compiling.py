"""The simulator is compiled on its first use, before a clock starts, and that is said as soon as it begins.

Numba keeps the machine code in NUMBA_CACHE_DIR, or beside the source, for this processor and this version of the code.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FunctionType

import numpy as np
from numba.core.event import Event, Listener, install_listener

from slipstick.bench import Conditions
from slipstick.clutch.ensemble import signals
from slipstick.clutch.model import Model

MESSAGE = "Compiling the simulator, once for this installation (10 to 30 s)"


def compile_simulator(model: Model, conditions: Conditions) -> None:
    """Load the compiled simulator, or compile it and say so on standard error."""
    with say_compilation():
        _with_room(lambda: signals(model, conditions.take([0]), np.zeros(1), threads=1))


@contextmanager
def say_compilation(message: str = MESSAGE) -> Iterator[None]:
    """Print `message` to standard error if numba compiles something in the block, whatever the thread.

    Code that is loaded from numba's cache is not compiled, and what numba never caches is not said.
    """
    with install_listener("numba:compile", _Speaker(message)):
        yield


class _Speaker(Listener):
    def __init__(self, message: str) -> None:
        self._message = message

    def on_start(self, event: Event) -> None:
        """Numba has not found in its cache what is called: it compiles."""
        if self._message and event.data["dispatcher"].stats.cache_path:
            print(self._message, file=sys.stderr, flush=True)
            self._message = ""

    def on_end(self, event: Event) -> None:
        """Nothing is said."""


def _call(function: Callable[[], object]) -> None:
    function()


_with_room = FunctionType(_call.__code__.replace(co_stacksize=1 << 16), globals(), "_with_room")
"""Calls a function from a frame of 0.5 MB, so that CPython maps memory for the frames of 0.5 MB more at once.

It maps 16 kB at a time, and unmaps them when the call returns that needed them. Where the many small calls of numba's
compiler come to lie across such a boundary, this took up to a third of its time: 600,000 mappings."""
