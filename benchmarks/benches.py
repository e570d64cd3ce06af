"""The shipped benches, and the points of the default table, which most benchmarks simulate."""

from pathlib import Path

import numpy as np

from slipstick.bench import Bench

ROOT = Path(__file__).parents[1]
HEAVY = Bench.open(ROOT / "tables" / "heavy.toml")
SHIPPED = {bench.name: bench for bench in (HEAVY, Bench.open(ROOT / "tables" / "compact.toml"))}
AXES = ("pressure_bias", "initial_position")
"""The parameters of the default table."""


def make_grid(count: int) -> np.ndarray:
    """Multipliers of `AXES` from 0.5 to 1.5 at count x count points, (count^2, 2)."""
    values = np.linspace(0.5, 1.5, count)
    return np.stack(np.meshgrid(values, values, indexing="ij"), axis=-1).reshape(-1, 2)
