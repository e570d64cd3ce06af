"""Compile the simulator, or load it if it is compiled: `python -m worker.compiling BENCH`."""

import sys

from slipstick.bench import Bench
from slipstick.building import compile_simulator
from slipstick.clutch.model import Model

if __name__ == "__main__":
    bench = Bench.open(sys.argv[1])
    compile_simulator(Model(bench.physics), bench.conditions)
