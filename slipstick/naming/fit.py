"""The mixed-effects fit of one block with given laws, by Gauss-Newton steps.

A block is linearised about the parameters of each engagement. With z = residual + columns @ values, the linear mixed
model of `grams` has the parameters themselves as coefficients, and not their changes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.blocks.whitening import BlockNoise, whitened
from slipstick.naming.block import Block, Laws, Pair
from slipstick.naming.grams import Fitted, Gram, estimate

LAW_PRECISION = 1 / 3**2
"""Precision of the normal prior of a law's coefficients, whose units are chosen so that 1 is a large change."""
_LOOSE = 0.3
"""Standard deviation, relative to nominal, of the prior of a parameter that is to be calibrated."""
_FIRST, _LEAST = 0.01**2, 1e-10  # variances of relative parameters: to begin with, and at least
_SETTLED = 1e-5  # change of relative parameters at which the fit ends
_RISE = 1.03
"""Factor by which the sum of squares may rise in a step: random effects give up squares for likelihood."""
_LOWEST, _HIGHEST = -0.7, 0.9  # of parameters relative to nominal, so that gains and times keep their sign


@dataclass(frozen=True, eq=False)
class BlockFit:
    """A block with `laws`: `points` (n, q) relative to nominal, `shared` (p,) and `coefficients` of the laws.

    `fitted` is the linear mixed model about them, `predicted` (n, k) the output, `noise` that of the block.
    """

    block: Block
    laws: tuple[Pair, ...]
    points: np.ndarray
    shared: np.ndarray
    coefficients: dict[Pair, np.ndarray]
    fitted: Fitted
    predicted: np.ndarray
    noise: BlockNoise

    @property
    def held(self) -> Laws:
        """The laws with their coefficients."""
        return [(law, self.coefficients[law]) for law in self.laws]

    @property
    def chi2(self) -> np.ndarray:
        """Reduced chi-square (n,) of the engagements."""
        counts = self.block.counted.sum(axis=1)
        return np.asarray(self.fitted.squares / np.maximum(counts - len(self.block.random), 1))


def predict(block: Block, points: np.ndarray, shared: np.ndarray, laws: Laws) -> np.ndarray:
    """The output (n, k) at parameters `points` (n, q) of the engagements and `shared` ones (p,)."""
    if hasattr(block, "at"):
        block.at(shared)
        return np.asarray(block.base(points, laws))
    total = block.base(points, laws)
    if len(shared):
        total = total + np.einsum("p,npk->nk", shared, block.shared_columns(points, laws, total))
    return np.asarray(total)


def priors(block: Block) -> np.ndarray:
    """Precision (q + p,) of the normal priors of the means and of the shared parameters."""
    std = np.concatenate([block.random_std, block.fixed_std])
    return np.asarray(1 / np.minimum(std, _LOOSE) ** 2)


def gram_of(block: Block, columns: Sequence[np.ndarray], z: np.ndarray, noise: BlockNoise, further: int) -> Gram:
    """Products of whitened columns (n, c, k), random ones first, and of z (n, k); the last `further` are of laws."""
    white = whitened(np.concatenate([*columns, z[:, None]], axis=1), block.counted, noise)
    precision = np.concatenate([priors(block), np.full(further, LAW_PRECISION)])
    return Gram(white @ white.transpose(0, 2, 1), len(block.random), precision, np.zeros_like(precision), block.widest)


def linearised(block: Block, points: np.ndarray, shared: np.ndarray, laws: Laws, noise: BlockNoise,
               predicted: np.ndarray, further: Sequence[Pair] = ()) -> tuple[Gram, dict[Pair, np.ndarray]]:
    """The products about these parameters, and the columns (n, m, k) of each law and of `further` pairs."""
    own, fixed = block.columns(points, laws, predicted)
    basis = {pair: block.basis(pair, points, laws, predicted) for pair in [*(pair for pair, _ in laws), *further]}
    basis = {pair: columns for pair, columns in basis.items() if columns.shape[1]}
    z = block.measured - predicted + np.einsum("nq,nqk->nk", points, own) + np.einsum("p,npk->nk", shared, fixed)
    for pair, values in laws:
        if pair in basis:
            z = z + np.einsum("m,nmk->nk", values, basis[pair])
    return gram_of(block, [own, fixed, *basis.values()], z, noise, sum(x.shape[1] for x in basis.values())), basis


def split(fitted: Fitted, shared: int, sizes: dict[Pair, int]) -> tuple[np.ndarray, np.ndarray, dict[Pair, np.ndarray]]:
    """Means (q,), shared parameters (p,) and coefficients of the laws from those of a linear fit."""
    first = fitted.gram.random + shared
    means, common, laws = fitted.coefficients[:fitted.gram.random], fitted.coefficients[fitted.gram.random:first], {}
    for pair, size in sizes.items():
        laws[pair] = fitted.coefficients[first:first + size]
        first += size
    return means, common, laws


def fit(block: Block, laws: tuple[Pair, ...] = (), start: BlockFit | None = None, iterations: int = 5) -> BlockFit:
    """Fit `block` with `laws` from another fit on, or from nominal values. A step that makes it worse is halved."""
    n, q = len(block.measured), len(block.random)
    points = np.zeros((n, q)) if start is None else start.points
    shared = np.zeros(len(block.fixed)) if start is None else start.shared
    known = {} if start is None else start.coefficients
    variance = np.full(q, _FIRST) if start is None else np.maximum(start.fitted.variance, 1e-8)
    bare = block.base(points, ())
    values = {pair: known[pair] if pair in known else np.zeros(block.basis(pair, points, (), bare).shape[1])
              for pair in laws}
    best: BlockFit | None = None
    least = np.inf
    for _ in range(iterations):
        held = [(pair, values[pair]) for pair in laws]
        predicted, noise = predict(block, points, shared, held), block.noise(points)
        cost = _squares(block, predicted, noise)
        if best is not None and not cost < _RISE * least + 2 * n:
            points, shared = 0.5 * (points + best.points), 0.5 * (shared + best.shared)
            values = {pair: 0.5 * (values[pair] + best.coefficients[pair]) for pair in laws}
            continue
        gram, basis = linearised(block, points, shared, held, noise, predicted)
        fitted = estimate(gram, variance)
        variance, least = np.clip(fitted.variance, _LEAST, block.widest**2), cost
        best = BlockFit(block, tuple(laws), points, shared, values, fitted, predicted, noise)
        means, shared, values = split(fitted, len(shared), {pair: x.shape[1] for pair, x in basis.items()})
        moved = np.clip(means + fitted.each, _LOWEST, _HIGHEST)
        change, points = float(np.abs(moved - points).max(initial=0)), moved
        if change < _SETTLED:
            break
    assert best is not None
    held = [(pair, values[pair]) for pair in laws]
    predicted = predict(block, points, shared, held)
    if _squares(block, predicted, best.noise) < _RISE * least + 2 * n:
        return BlockFit(block, tuple(laws), points, shared, values, best.fitted, predicted, best.noise)
    predict(block, best.points, best.shared, best.held)  # the block holds what was predicted last
    return best


def _squares(block: Block, predicted: np.ndarray, noise: BlockNoise) -> float:
    """Sum of squared whitened residuals."""
    return float((whitened((block.measured - predicted)[:, None], block.counted, noise) ** 2).sum())
