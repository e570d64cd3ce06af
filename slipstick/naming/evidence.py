"""What each hypothesis gains: held-out log-likelihood of every engagement, with all random effects estimated again."""

from dataclasses import dataclass

import numpy as np

from slipstick.blocks.whitening import whitened
from slipstick.naming.fit import LAW_PRECISION, BlockFit, gram_of
from slipstick.naming.grams import Gram, estimate, likelihood, solve

FOLDS = 6


@dataclass(frozen=True, eq=False)
class Table:
    """The products of a block about its fit, with columns of all its pairs: `places` are those of each pair."""

    fit: BlockFit
    gram: Gram
    places: dict
    basis: dict


def table(fit: BlockFit, pairs=None) -> Table:
    block = fit.block
    held = [(pair, fit.coefficients[pair]) for pair in fit.laws]
    own, fixed = block.columns(fit.points, held, fit.predicted)
    wanted = [pair for pair in block.pairs() if (pairs is None or pair in pairs)]
    wanted = list(dict.fromkeys([*fit.laws, *wanted]))
    X = {pair: block.basis(pair, fit.points, held, fit.predicted) for pair in wanted}
    X = {pair: x for pair, x in X.items() if x.shape[1]}
    z = block.measured - fit.predicted + np.einsum("nq,nqk->nk", fit.points, own) + np.einsum("p,npk->nk", fit.shared, fixed)
    for pair, c in held:
        z = z + np.einsum("m,nmk->nk", c, X[pair])
    gram = gram_of(block, [own, fixed, *X.values()], z, fit.noise, sum(x.shape[1] for x in X.values()))
    places, first = {}, fixed.shape[1]
    for pair, x in X.items():
        places[pair] = np.arange(first, first + x.shape[1])
        first += x.shape[1]
    return Table(fit, gram, places, X)


def joined(tables: list[Table], laws: list) -> tuple[Gram, dict]:
    """One gram of several blocks: random and fixed columns apart, those of `laws` in common."""
    q = [t.gram.random for t in tables]
    p = [len(t.fit.block.fixed) for t in tables]
    sizes = {law: max((len(t.places[law]) for t in tables if law in t.places), default=0) for law in laws}
    total = sum(q) + sum(p) + sum(sizes.values()) + 1
    n = len(tables[0].gram)
    products = np.zeros((n, total, total))
    precision = np.full(total - 1, LAW_PRECISION)
    widest = np.concatenate([t.gram.widest for t in tables])
    at_law, first = {}, sum(q) + sum(p)
    for law in laws:
        at_law[law] = np.arange(first, first + sizes[law])
        first += sizes[law]
    for b, t in enumerate(tables):
        rows = [*range(t.gram.random), *(t.gram.random + np.arange(p[b]))]
        to = [*(sum(q[:b]) + np.arange(q[b])), *(sum(q) + sum(p[:b]) + np.arange(p[b]))]
        precision[to] = t.gram.precision[rows]
        for law in laws:
            if law in t.places:
                rows += list(t.gram.random + t.places[law])
                to += list(at_law[law][:len(t.places[law])])
        rows.append(t.gram.products.shape[1] - 1)
        to.append(total - 1)
        products[:, np.array(to)[:, None], np.array(to)] += t.gram.products[:, np.array(rows)[:, None], np.array(rows)]
    return Gram(products, sum(q), precision, np.zeros(total - 1), widest), at_law


def folds(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).permutation(np.arange(n) % FOLDS)


def held_out(gram: Gram, fitted, split: np.ndarray) -> np.ndarray:
    """Log-likelihood (n,) of each engagement with coefficients from the other folds."""
    out = np.empty(len(gram))
    ridge = gram.precision
    for f in range(split.max() + 1):
        rows = split == f
        coefficients, _ = solve(gram, fitted.marginal[~rows])
        out[rows] = likelihood(fitted.marginal[rows], fitted.logdet[rows], coefficients)
    return out


def gains(tables: list[Table], current: list, pairs: list, variances: dict | None = None, split=None):
    """Gain (n,) of each pair beside the `current` laws, and its fit."""
    by_name = {t.fit.block.name: t for t in tables}
    split = folds(len(tables[0].gram)) if split is None else split
    found, bases_ = {}, {}
    for pair in pairs:
        mine = [t for t in tables if pair in t.places]
        if not mine:
            continue
        key = tuple(t.fit.block.name for t in mine)
        laws = [law for law in current if any(law in t.places for t in mine)]
        if key not in bases_:
            gram, at = joined(mine, laws)
            start = np.concatenate([np.maximum(t.fit.fitted.variance, 1e-8) for t in mine])
            base = estimate(gram, start)
            bases_[key] = base, held_out(gram, base, split)
        base, reference = bases_[key]
        gram, at = joined(mine, [*laws, pair])
        fitted = estimate(gram, np.maximum(base.variance, 1e-8))
        found[pair] = held_out(gram, fitted, split) - reference, fitted, at[pair], key
    return found
