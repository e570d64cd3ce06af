"""The mixed model of a block that is far from linear: Laplace's approximation, with steps that never lower the likelihood."""

from dataclasses import dataclass

import numpy as np

from slipstick.blocks.whitening import whitened
from slipstick.naming.fit import BlockFit, gram_of, predict, priors
from slipstick.naming.grams import estimate

_SHARES = (1.0, 0.5, 0.2, 0.05, 0.0)
_LEAST = 1e-4**2
_LONGEST = 0.25
"""Longest step of a parameter of an engagement, relative to nominal."""


@dataclass(frozen=True, eq=False)
class CurvedFit(BlockFit):
    mean: np.ndarray = None
    variance: np.ndarray = None
    evidence: np.ndarray = None  # (n,) log-likelihood with random effects integrated out

    @property
    def chi2(self):
        return self.squares / np.maximum(self.block.counted.sum(axis=1) - len(self.block.random), 1)

    squares: np.ndarray = None


def squares_of(block, points, shared, laws, noise):
    left = block.measured - predict(block, points, shared, laws)
    return (whitened(left[:, None], block.counted, noise) ** 2).sum(axis=(1, 2))


def spread_of(points, information, precision, widest, variance):
    """Mean and variances of the parameters (n, q) of engagements known with `information` (n, q, q), by EM."""
    q = points.shape[1]
    for _ in range(30):
        mean = (points / variance).sum(axis=0) / (len(points) / variance + precision[:q])
        posterior = np.linalg.inv(information + np.diag(1 / variance))
        new = ((points - mean) ** 2 + np.einsum("nqq->nq", posterior)).mean(axis=0)
        new = np.clip(new, _LEAST, widest**2)
        done = np.all(np.abs(new / variance - 1) < 0.01)
        variance = new
        if done:
            break
    return mean, variance


def fit_curved(block, laws=(), start=None, iterations=12, points=None, coefficients=None):
    n, q, p = len(block.measured), len(block.random), len(block.fixed)
    if start is not None:
        points, shared, variance = start.points, start.shared, start.variance
        known = dict(start.coefficients)
    else:
        shared, variance, known = np.zeros(p), np.full(q, 0.03**2), {}
        variance[0] = 0.01**2
    known.update(coefficients or {})
    laws = tuple(laws)
    c = {pair: known.get(pair, np.zeros(block.size(pair))) for pair in laws}
    sizes = [len(c[pair]) for pair in laws]
    noise = block.noise(points)
    precision = priors(block)
    last = None
    for it in range(iterations + 1):
        held = [(pair, c[pair]) for pair in laws]
        predicted = predict(block, points, shared, held)
        own, fixed = block.columns(points, held, predicted)
        X = [block.basis(pair, points, held, predicted) for pair in laws]
        z = block.measured - predicted + np.einsum("nq,nqk->nk", points, own) + np.einsum("p,npk->nk", shared, fixed)
        for (pair, value), x in zip(held, X):
            z = z + np.einsum("m,nmk->nk", value, x)
        gram = gram_of(block, [own, fixed, *X], z, noise, sum(sizes))
        information = gram.products[:, :q, :q]
        mean, variance = spread_of(points, information, precision, block.widest, variance)
        squares = squares_of(block, points, shared, held, noise)
        logdet = np.linalg.slogdet(np.eye(q) + information * variance)[1]
        beyond = np.concatenate([shared, *[v for _, v in held]])
        prior = (np.append(mean, beyond) ** 2 * precision_of(precision, sum(sizes))).sum()
        cost = squares + ((points - mean) ** 2 / variance).sum(axis=1)
        evidence = -0.5 * (cost + logdet + prior / n)
        if last is not None and abs(evidence.sum() - last) < 0.3 and it > 1:
            break
        last = evidence.sum()
        if it == iterations:
            break
        fitted = estimate(gram, variance, fixed=True)
        aim = fitted.coefficients[:q]
        new = points + np.clip(np.clip(aim + fitted.each, -0.9, 2.0) - points, -_LONGEST, _LONGEST)
        new_shared, new_c, place = fitted.coefficients[q:q + p], {}, q + p
        for pair, size in zip(laws, sizes):
            new_c[pair] = fitted.coefficients[place:place + size]
            place += size

        def at(own_share, common):
            pts = points + own_share * (new - points)
            lw = [(pair, c[pair] + common * (new_c[pair] - c[pair])) for pair in laws]
            m = mean + common * (aim - mean)
            value = squares_of(block, pts, shared + common * (new_shared - shared), lw, noise) + ((pts - m) ** 2 / variance).sum(axis=1)
            return value

        both = [at(share, share) for share in _SHARES[:-1]] + [cost]
        common = _SHARES[int(np.argmin([one.sum() for one in both]))]
        each = np.array([both[_SHARES.index(common)] if share == common else at(share, common) for share in _SHARES])
        best = np.array(_SHARES)[np.argmin(each, axis=0)][:, None]
        points = points + best * (new - points)
        shared = shared + common * (new_shared - shared)
        c = {pair: c[pair] + common * (new_c[pair] - c[pair]) for pair in laws}
    fitted = estimate(gram, variance, fixed=True)
    return CurvedFit(block, laws, points, shared, c, fitted, predicted, noise, mean, variance, evidence, squares)


def precision_of(precision, extra):
    from slipstick.naming.fit import LAW_PRECISION
    return np.concatenate([precision, np.full(extra, LAW_PRECISION)])
