"""The simulator is compiled on its first use, before a command starts its clock: `python -m worker.compiling BENCH`.

Numba keeps the machine code in NUMBA_CACHE_DIR, or beside the source, for this processor and this version of the code.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from threading import Timer
from types import FunctionType

import numpy as np

from slipstick.bench import Bench, Conditions
from slipstick.clutch.ensemble import signals
from slipstick.clutch.model import Model

_SILENT_SECONDS = 1.0


def compile_simulator(model: Model, conditions: Conditions) -> None:
    """Load the compiled simulator, or compile it, and say so on standard error if that takes more than a second."""
    message = Timer(_SILENT_SECONDS, _say)
    message.start()
    try:
        _with_room(lambda: signals(model, conditions.take([0]), np.zeros(1), threads=1))
    finally:
        message.cancel()


def _call(function: Callable[[], object]) -> None:
    function()


_with_room = FunctionType(_call.__code__.replace(co_stacksize=1 << 16), globals(), "_with_room")
"""Calls a function from a frame of 0.5 MB, so that CPython maps memory for the frames of 0.5 MB more at once.

It maps 16 kB at a time, and unmaps them when the call returns that needed them. Where the many small calls of numba's
compiler come to lie across such a boundary, this took up to a third of its time: 600,000 mappings."""


def _say() -> None:
    print("Compiling the simulator, once for this installation (about 10 s)", file=sys.stderr, flush=True)


if __name__ == "__main__":
    bench = Bench.open(Path(sys.argv[1]))
    compile_simulator(Model(bench.physics), bench.conditions)
