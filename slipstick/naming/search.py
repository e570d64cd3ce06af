"""Start values of the piston: pressure bias and initial position of each engagement, by search."""

import numpy as np

from slipstick.blocks.whitening import whitened


def search(block, laws=(), levels=9):
    """Points (n, q) with the best pressure bias and initial position on grids, common first and then of each engagement."""
    n, q = len(block.measured), len(block.random)
    bench = block.scene.bench
    bias, place = (bench.prior(name) for name in ("pressure_bias", "initial_position"))
    low, high = np.array([bias.lower, place.lower]) - 1, np.array([bias.upper, place.upper]) - 1
    points = np.zeros((n, q))
    few = slice(None, None, max(1, n // 24))
    columns = [1, 2]

    def misfits(values):
        points[:, columns] = values
        predicted = block.simulate(points, laws) * block.counted
        measured = block.measured * block.counted
        scale = (predicted * measured).sum(1) / np.maximum((predicted**2).sum(1), 1e-9)
        scale = np.clip(scale, 0.5, 1.5)
        return ((measured - scale[:, None] * predicted) ** 2).sum(axis=1), scale

    l, h = low.copy(), high.copy()
    for _ in range(4):
        grid = np.stack(np.meshgrid(*(np.linspace(a, b, levels) for a, b in zip(l, h)), indexing="ij"), -1).reshape(-1, 2)
        best = grid[np.argmin([misfits(g)[0].sum() for g in grid])]
        spacing = 2 * (h - l) / (levels - 1)
        l, h = np.maximum(low, best - spacing), np.minimum(high, best + spacing)
    common = best
    # each engagement: along both axes about the common optimum
    width = np.array([0.15, 0.3])
    best_value, best_at, scale = np.full(n, np.inf), np.tile(common, (n, 1)), np.ones(n)
    grid = np.stack(np.meshgrid(*(np.linspace(-1, 1, 11) * w for w in width), indexing="ij"), -1).reshape(-1, 2)
    sigma = block.scene.noise["output_torque"][0]
    for g in grid:
        value, its = misfits(common + g)
        value = value / sigma**2 + ((g / width) ** 2).sum() * 4
        better = value < best_value
        best_value, best_at, scale = np.where(better, value, best_value), np.where(better[:, None], common + g, best_at), np.where(better, its, scale)
    points[:, columns] = best_at
    points[:, 0] = scale - 1
    return points


def retimed(block, points, laws):
    """Points (n, q) with the pressure bias at which each engagement's torque fits best: when the plates meet."""
    n = len(points)
    sigma = block.scene.noise["output_torque"][0]

    def cost(shift):
        at = points.copy()
        at[:, 1] += shift
        left = (block.measured - block.simulate(at, laws)) * block.counted
        return (left**2).sum(axis=1) / sigma**2 + (shift / 0.3) ** 2

    best = np.zeros(n)
    value = cost(best)
    for width, levels in ((0.5, 21), (0.05, 11)):
        centre = best.copy()
        for shift in np.linspace(-width, width, levels):
            its = cost(centre + shift)
            better = its < value
            best, value = np.where(better, centre + shift, best), np.where(better, its, value)
    moved = points.copy()
    moved[:, 1] += best
    return moved


def relocated(block, points, laws, rows):
    """Points (n, q) where the engagements `rows` (n,) are searched again over pressure bias and initial position."""
    n = len(points)
    sigma = block.scene.noise["output_torque"][0]
    best, value = points.copy(), np.full(n, np.inf)
    for bias in np.linspace(-0.6, 0.6, 17):
        for place in np.linspace(-0.9, 0.9, 13):
            at = points.copy()
            at[:, 1] += bias
            at[:, 2] += place
            left = (block.measured - block.simulate(at, laws)) * block.counted
            its = (left**2).sum(axis=1) / sigma**2 + (bias / 0.3) ** 2 + (place / 0.5) ** 2
            better = its < value
            best, value = np.where(better[:, None], at, best), np.where(better, its, value)
    return np.where(rows[:, None], best, points)
