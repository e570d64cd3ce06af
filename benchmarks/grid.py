"""The points of the benchmarks, on the axes of the default table."""

import numpy as np

AXES = ("pressure_bias", "initial_position")


def points(count: int) -> np.ndarray:
    """A grid of count x count multipliers from 0.5 to 1.5: (count^2, 2)."""
    grid = np.linspace(0.5, 1.5, count)
    return np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1).reshape(-1, 2)
