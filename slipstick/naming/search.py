"""Start values of the piston: pressure bias and initial position of each engagement, by search over grids.

Gauss-Newton from nominal values ends in local minima, because a bias and an initial position both shift the onset of
the torque. Squares are summed over the samples that a block counts, with a penalty on the distance from common values;
`shared` (p,) are the values that all engagements have in common.
"""

from itertools import product

import numpy as np

from slipstick.naming.block import Laws, SearchedBlock
from slipstick.naming.curved_steps import HIGHEST, LOWEST
from slipstick.numerics.threads import mapped

_FRICTION, _BIAS, _PLACE = 0, 1, 2
"""Places of friction coefficient, pressure bias and initial position among the parameters of the clutch."""
_LEVELS, _ROUNDS = 9, 4
"""Levels of the grid of common values on either axis, and rounds, each of which halves the range."""
_SCALES = (0.5, 1.5)
"""Range of the friction coefficient relative to nominal: it scales the torque and is solved for."""
_WIDTH, _OWN_LEVELS = np.array([0.15, 0.3]), 11
"""Range and levels of bias and position of an engagement about the common ones; widths also scale the penalty."""
_PENALTY = 4
"""Penalty in squares at the edge of that range: two standard errors."""
_RETIMED, _RETIMED_SPREAD = ((0.5, 21), (0.05, 11)), 0.3
"""Range and levels of the bias in either round of `retimed`, and the standard deviation of its penalty."""
_RELOCATED, _RELOCATED_SPREAD = ((0.6, 17), (0.9, 13)), (0.3, 0.5)
"""The same of bias and position in `relocated`: wider, for engagements that the first search missed."""


def search(block: SearchedBlock, shared: np.ndarray, laws: Laws = ()) -> np.ndarray:
    """Points (n, q) with the best friction, bias and initial position: in common first, then for each engagement."""
    block, n, bench = block.at(shared), len(block.measured), block.scene.bench
    points, measured = np.zeros((n, len(block.random))), block.measured * block.counted

    def misfits(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Squares (n,) at bias and position (2,), and the factors (n,) of the torque that fit best."""
        at = np.zeros_like(points)
        at[:, [_BIAS, _PLACE]] = values
        predicted = block.base(at, laws) * block.counted
        scale = (predicted * measured).sum(axis=1) / np.maximum((predicted**2).sum(axis=1), 1e-9)
        scale = np.clip(scale, *_SCALES)
        return ((measured - scale[:, None] * predicted) ** 2).sum(axis=1), scale

    priors = [bench.prior(name) for name in ("pressure_bias", "initial_position")]
    lowest, highest = np.array([(prior.lower, prior.upper) for prior in priors]).T - 1
    low, high, common = lowest, highest, np.zeros(2)
    for _ in range(_ROUNDS):
        places = _grid(low, high, _LEVELS)
        common = places[np.argmin([squares.sum() for squares, _ in mapped(misfits, list(places))])]
        spacing = 2 * (high - low) / (_LEVELS - 1)
        low, high = np.maximum(lowest, common - spacing), np.minimum(highest, common + spacing)
    best, at, scale = np.full(n, np.inf), np.tile(common, (n, 1)), np.ones(n)
    shifts = _grid(-_WIDTH, _WIDTH, _OWN_LEVELS)
    for shift, (squares, factors) in zip(shifts, mapped(misfits, list(common + shifts)), strict=True):
        value = squares / _variance(block) + ((shift / _WIDTH) ** 2).sum() * _PENALTY
        better = value < best
        best, scale = np.where(better, value, best), np.where(better, factors, scale)
        at = np.where(better[:, None], common + shift, at)
    points[:, [_BIAS, _PLACE]] = at
    points[:, _FRICTION] = scale - 1
    return points


def retimed(block: SearchedBlock, points: np.ndarray, shared: np.ndarray, laws: Laws) -> np.ndarray:
    """Points (n, q) with the pressure bias at which each engagement's torque fits best: when the plates meet."""
    block = block.at(shared)

    def cost(shift: np.ndarray) -> np.ndarray:
        return _squares(block, block.base(_moved(points, shift), laws)) + (shift / _RETIMED_SPREAD) ** 2

    best = np.zeros(len(points))
    value = cost(best)
    for width, levels in _RETIMED:
        tried = [best + shift for shift in np.linspace(-width, width, levels)]
        for bias, costs in zip(tried, mapped(cost, tried), strict=True):
            better = costs < value
            best, value = np.where(better, bias, best), np.where(better, costs, value)
    return _moved(points, best)


def relocated(block: SearchedBlock, points: np.ndarray, shared: np.ndarray, laws: Laws, rows: np.ndarray) -> np.ndarray:
    """Points (n, q) where the engagements `rows` (n,) are searched again over pressure bias and initial position."""
    block = block.at(shared)

    def cost(shift: tuple[float, float]) -> np.ndarray:
        penalty = sum((component / std) ** 2 for component, std in zip(shift, _RELOCATED_SPREAD, strict=True))
        return _squares(block, block.part(_moved(points, *shift), laws, rows)) + penalty

    best, value = points.copy(), np.full(len(points), np.inf)
    shifts = list(product(*(np.linspace(-width, width, levels) for width, levels in _RELOCATED)))
    for shift, costs in zip(shifts, mapped(cost, shifts), strict=True):
        better = costs < value
        best, value = np.where(better[:, None], _moved(points, *shift), best), np.where(better, costs, value)
    return np.where(rows[:, None], best, points)


def _grid(low: np.ndarray, high: np.ndarray, levels: int) -> np.ndarray:
    """Points (levels^2, 2) of a grid between two corners (2,)."""
    axes = (np.linspace(a, b, levels) for a, b in zip(low, high, strict=True))
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)


def _moved(points: np.ndarray, bias: np.ndarray | float, place: float = 0.0) -> np.ndarray:
    """Points with further bias and position, as far as a fit may go."""
    moved = points.copy()
    moved[:, _BIAS] += bias
    moved[:, _PLACE] += place
    return np.asarray(np.clip(moved, LOWEST, HIGHEST))


def _variance(block: SearchedBlock) -> float:
    return block.scene.noise["output_torque"][0] ** 2


def _squares(block: SearchedBlock, predicted: np.ndarray) -> np.ndarray:
    """Squared residuals (n,) of a prediction (n, k) in noise levels."""
    left = (block.measured - predicted) * block.counted
    return np.asarray((left**2).sum(axis=1) / _variance(block))
