"""The simulator is compiled on its first use, before a command starts its clock: `python -m worker.compiling BENCH`.

Numba keeps the machine code in NUMBA_CACHE_DIR, or beside the source, for this processor and this version of the code.
"""

import sys
from pathlib import Path
from threading import Timer

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
        signals(model, conditions.take([0]), np.zeros(1), threads=1)
    finally:
        message.cancel()


def _say() -> None:
    print("Compiling the simulator, once for this installation (about 10 s)", file=sys.stderr, flush=True)


if __name__ == "__main__":
    bench = Bench.open(Path(sys.argv[1]))
    compile_simulator(Model(bench.physics), bench.conditions)
