"""The linear mixed model of a block about given parameters, and the joint one of blocks that share laws.

A block is linearised about the parameters of each engagement. With z = residual + columns @ values, the linear mixed
model of `grams` has the parameters themselves as coefficients, and not their changes.

A law that several blocks have, such as the error of a sensor that drives them, has the same coefficients in all of
them. Their residuals are independent given their inputs, so that the products add up.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.blocks.whitening import BlockNoise, whitened
from slipstick.naming.block import Block, Laws, Pair
from slipstick.naming.grams import Gram
from slipstick.threads import mapped

LAW_PRECISION = 1 / 3**2
"""Precision of the normal prior of a law's coefficients, whose units are chosen so that 1 is a large change."""
_LOOSE = 0.3
"""Standard deviation, relative to nominal, of the prior of a parameter that is to be calibrated."""
_AT_ONCE = 8
"""Engagements whose columns are whitened at a time, so that they stay in the cache."""


def predict(block: Block, points: np.ndarray, shared: np.ndarray, laws: Laws) -> np.ndarray:
    """The output (n, k) at parameters `points` (n, q) of the engagements and `shared` ones (p,)."""
    if hasattr(block, "at"):
        block.at(shared)
        return np.asarray(block.base(points, laws))
    total = block.base(points, laws)
    if len(shared):
        total = total + shared @ block.shared_columns(points, laws, total)
    return np.asarray(total)


def priors(block: Block) -> np.ndarray:
    """Precision (q + p,) of the normal priors of the means and of the shared parameters."""
    std = np.concatenate([block.random_std, block.fixed_std])
    return np.asarray(1 / np.minimum(std, _LOOSE) ** 2)


def gram_of(block: Block, columns: Sequence[np.ndarray], z: np.ndarray, noise: BlockNoise, further: int,
            apart: Sequence[np.ndarray] = ()) -> Gram:
    """Products of whitened columns (n, c, k), random ones first, and of z (n, k); the last `further` are of laws.

    Columns of laws at places `apart` do not enter a fit together: products of one with another are not a number.
    """
    last = int(np.flatnonzero(block.counted.any(axis=0)).max(initial=0)) + 1  # white columns are 0 beyond
    count = sum(one.shape[1] for one in columns) + 1
    products = np.full((len(z), count, count), np.nan)
    common = np.setdiff1d(np.arange(count), np.concatenate([[], *apart]))

    def multiply(first: int) -> None:
        rows = slice(first, first + _AT_ONCE)
        some = np.concatenate([*(one[rows, :, :last] for one in columns), z[rows, None, :last]], axis=1)
        white = whitened(some, block.counted[rows, :last], noise.of(rows))
        if not apart:
            products[rows] = white @ white.transpose(0, 2, 1)
            return
        products[rows, common] = with_common = white[:, common] @ white.transpose(0, 2, 1)
        products[rows, :, common] = with_common.transpose(0, 2, 1)
        for places in apart:
            its = slice(places[0], places[-1] + 1)
            products[rows, its, its] = white[:, its] @ white[:, its].transpose(0, 2, 1)

    mapped(multiply, range(0, len(z), _AT_ONCE))
    precision = np.concatenate([priors(block), np.full(further, LAW_PRECISION)])
    return Gram(products, len(block.random), precision, np.zeros_like(precision), block.widest)


@dataclass(frozen=True, eq=False)
class Part:
    """What a block brings into a joint linear model: its products `gram`, and `places` of laws among its fixed columns.

    The first `shared` fixed columns are those of its own shared parameters.
    """

    gram: Gram
    shared: int
    places: dict[Pair, np.ndarray]


@dataclass(frozen=True, eq=False)
class Joint:
    """The `gram` of several parts in which laws have common coefficients at `places`.

    `rows` are the places of each part's own coefficients and of those laws that it has.
    """

    gram: Gram
    places: dict[Pair, np.ndarray]
    rows: list[np.ndarray]


def linearised(block: Block, points: np.ndarray, shared: np.ndarray, laws: Laws, noise: BlockNoise,
               predicted: np.ndarray, pairs: Sequence[Pair], apart: Sequence[Pair] = ()) -> Part:
    """The products about these parameters, with the columns of `pairs`, among which are those of `laws`.

    Each of the pairs `apart` is tried without the others, so that there are no products of one with another.
    """
    own, fixed = block.columns(points, laws, predicted)
    basis = {pair: block.basis(pair, points, laws, predicted) for pair in (*pairs, *apart)}
    basis = {pair: columns for pair, columns in basis.items() if columns.shape[1]}
    z = block.measured - predicted + np.einsum("nq,nqk->nk", points, own) + shared @ fixed
    for pair, values in laws:
        if pair in basis:
            z = z + values @ basis[pair]
    ends = len(shared) + np.cumsum([0, *(columns.shape[1] for columns in basis.values())])
    places = {pair: np.arange(ends[i], ends[i + 1]) for i, pair in enumerate(basis)}
    gram = gram_of(block, [own, fixed, *basis.values()], z, noise, int(ends[-1] - ends[0]),
                   [own.shape[1] + places[pair] for pair in apart if pair in places])
    return Part(gram, len(shared), places)


def joined(parts: Sequence[Part], laws: Sequence[Pair]) -> Joint:
    """The joint linear model of several parts, in which `laws` have the same coefficients."""
    random, shared = [one.gram.random for one in parts], [one.shared for one in parts]
    places, first = {}, sum(random) + sum(shared)
    for law in laws:
        size = max((len(one.places[law]) for one in parts if law in one.places), default=0)
        places[law] = np.arange(first, first + size)
        first += size
    products = np.zeros((len(parts[0].gram), first + 1, first + 1))
    precision, rows = np.full(first, LAW_PRECISION), []
    for b, one in enumerate(parts):
        own = np.arange(random[b] + shared[b])
        to = np.concatenate([sum(random[:b]) + np.arange(random[b]), sum(random) + sum(shared[:b])
                             + np.arange(shared[b])])
        precision[to] = one.gram.precision[own]
        mine = [law for law in laws if law in one.places]
        here = np.concatenate([own, *(random[b] + one.places[law] for law in mine), [one.gram.products.shape[1] - 1]])
        rows.append(np.concatenate([to, *(places[law][:len(one.places[law])] for law in mine)]))
        there = np.append(rows[b], first)
        products[:, there[:, None], there] += one.gram.products[:, here[:, None], here]
    widest = np.concatenate([one.gram.widest for one in parts])
    return Joint(Gram(products, sum(random), precision, np.zeros(first), widest), places, rows)
