"""Gauss-Newton with random effects of one block with given laws; then the products with the columns of all candidates.

A block is linearised about the parameters of each engagement. With z = residual + columns @ values, the linear mixed model of
`grams` has the parameters themselves as coefficients, and not their changes.
"""

from dataclasses import dataclass

import numpy as np

from slipstick.blocks.whitening import whitened
from slipstick.naming.grams import Fitted, Gram, estimate


@dataclass(frozen=True, eq=False)
class BlockFit:
    block: object
    laws: tuple
    points: np.ndarray
    shared: np.ndarray
    coefficients: dict
    fitted: Fitted
    predicted: np.ndarray
    noise: object

    @property
    def chi2(self):
        """Reduced chi-square (n,) of the engagements."""
        counts = self.block.counted.sum(axis=1)
        return self.fitted.squares / np.maximum(counts - len(self.block.random), 1)


def predict(block, points, shared, laws):
    if hasattr(block, "at"):
        block.at(shared)
        return block.base(points, laws)
    total = block.base(points, laws)
    if len(shared):
        total = total + np.einsum("p,npk->nk", shared, block.shared_columns(points, laws, total))
    return total


LAW_PRECISION = 1 / 3**2
LOOSE = 0.3


def priors(block):
    q = len(block.random)
    std = np.concatenate([block.random_std, block.fixed_std])
    return 1 / np.minimum(std, LOOSE) ** 2


def gram_of(block, rows, z, noise, extra_columns):
    """Products of own, fixed and further columns and z."""
    columns = np.concatenate([*rows, z[:, None]], axis=1)
    w = whitened(columns, block.counted, noise)
    products = w @ w.transpose(0, 2, 1)
    precision = np.concatenate([priors(block), np.full(extra_columns, LAW_PRECISION)])
    return Gram(products, len(block.random), precision, np.zeros_like(precision), block.widest)


def fit(block, laws=(), start=None, iterations=5):
    n, q, p = len(block.measured), len(block.random), len(block.fixed)
    points = np.zeros((n, q)) if start is None else start.points
    shared = np.zeros(p) if start is None else start.shared
    known = {} if start is None else start.coefficients
    variance = np.full(q, 0.01**2) if start is None else np.maximum(start.fitted.variance, 1e-8)
    predicted = block.base(points)
    coefficients = {pair: known[pair] if pair in known else np.zeros(block.basis(pair, points, (), predicted).shape[1]) for pair in laws}
    best = None
    for it in range(iterations):
        held = [(pair, coefficients[pair]) for pair in laws]
        predicted = predict(block, points, shared, held)
        noise = block.noise(points)
        cost = float((whitened((block.measured - predicted)[:, None], block.counted, noise) ** 2).sum())
        if best is not None and not cost < 1.02 * best[0] + 2 * n:
            # The step was too long for the linearisation: half of it.
            step = tuple(0.5 * (now - old) for now, old in zip((points, shared), best[1:3], strict=True))
            points, shared = best[1] + step[0], best[2] + step[1]
            coefficients = {pair: 0.5 * (coefficients[pair] + best[3][pair]) for pair in laws}
            continue
        best = cost, points, shared, coefficients
        own, fixed = block.columns(points, held, predicted)
        X = [block.basis(pair, points, held, predicted) for pair in laws]
        z = block.measured - predicted + np.einsum("nq,nqk->nk", points, own) + np.einsum("p,npk->nk", shared, fixed)
        for pair, x in zip(laws, X):
            z = z + np.einsum("m,nmk->nk", coefficients[pair], x)
        gram = gram_of(block, [own, fixed, *X], z, noise, sum(x.shape[1] for x in X))
        fitted = estimate(gram, variance)
        variance = np.clip(fitted.variance, 1e-10, block.widest**2)
        about = predicted, points, shared, coefficients, noise
        new = np.clip(fitted.coefficients[:q] + fitted.each, -0.7, 0.9)
        new_shared, place, new_laws = fitted.coefficients[q:q + p], q + p, {}
        for pair, x in zip(laws, X):
            new_laws[pair] = fitted.coefficients[place:place + x.shape[1]]
            place += x.shape[1]
        change = np.abs(new - points).max(initial=0)
        points, shared, coefficients = new, new_shared, new_laws
        if change < 1e-5:
            break
    held = [(pair, coefficients[pair]) for pair in laws]
    predicted = predict(block, points, shared, held)
    cost = float((whitened((block.measured - predicted)[:, None], block.counted, noise) ** 2).sum())
    if not cost < 1.02 * best[0] + 2 * n:
        predicted, points, shared, coefficients, noise = about
        predict(block, points, shared, [(pair, coefficients[pair]) for pair in laws])
    return BlockFit(block, tuple(laws), points, shared, coefficients, fitted, predicted, noise)
