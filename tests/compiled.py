"""Compile the simulator into its cache, which `make test` does beside ruff and mypy: `python -m tests.compiled`."""

import numpy as np

from slipstick.clutch import ensemble
from tests.benches import HEAVY, NOMINAL

if __name__ == "__main__":
    ensemble.signals(NOMINAL, HEAVY.conditions.take([0]), np.array([0.0, 0.1]))
