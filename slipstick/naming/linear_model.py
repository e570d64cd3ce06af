"""The linear mixed model of a block about given parameters, and the joint one of blocks that share laws.

A block is linearised about the parameters of each engagement. With z = residual + columns @ values, the linear mixed
model of `grams` has the parameters themselves as coefficients, and not their changes.

A law that several blocks have, such as the error of a sensor that drives them, has the same coefficients in all of
them. Their residuals are independent given their inputs, so that the products add up.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.blocks.whitening import BlockNoise, whitened
from slipstick.engine.linear_model import Gram
from slipstick.naming.block import Block, Laws, Pair
from slipstick.numerics.threads import mapped

LAW_PRECISION = 1 / 3**2
"""Precision of the normal prior of a law's coefficients, whose units are chosen so that 1 is a large change."""
_LOOSE = 0.3
"""Standard deviation, relative to nominal, of the prior of a parameter that is to be calibrated."""
_AT_ONCE = 8
"""Engagements whose columns are whitened at a time, so that they stay in the cache."""


def priors(block: Block) -> np.ndarray:
    """Precision (q + p,) of the normal priors of the means and of the shared parameters."""
    std = np.concatenate([block.random_std, block.fixed_std])
    return np.asarray(1 / np.minimum(std, _LOOSE) ** 2)


def gram_of(block: Block, columns: Sequence[np.ndarray], z: np.ndarray, noise: BlockNoise, further: int) -> Gram:
    """Products of whitened columns (n, c, k), random ones first, and of z (n, k); the last `further` are of laws."""
    count = sum(group.shape[1] for group in columns) + 1
    products = np.empty((len(z), count, count))

    def multiply(rows: slice, white: np.ndarray) -> None:
        products[rows] = white @ white.transpose(0, 2, 1)

    _each_white(block, [*columns, z[:, None]], noise, multiply)
    precision = np.concatenate([priors(block), np.full(further, LAW_PRECISION)])
    return Gram(products, len(block.random), precision, np.zeros_like(precision), block.widest)


def _each_white(block: Block, columns: Sequence[np.ndarray], noise: BlockNoise,
                use: Callable[[slice, np.ndarray], None]) -> None:
    """Call `use` with some engagements after the other, and their whitened columns (m, c, k)."""
    last = int(np.flatnonzero(block.counted.any(axis=0)).max(initial=0)) + 1  # white columns are 0 beyond

    def whiten(first: int) -> None:
        rows = slice(first, first + _AT_ONCE)
        batch = np.concatenate([group[rows, :, :last] for group in columns], axis=1)
        use(rows, whitened(batch, block.counted[rows, :last], noise.of(rows)))

    mapped(whiten, range(0, len(block.counted), _AT_ONCE))


@dataclass(frozen=True, eq=False)
class Columns:
    """The columns of a block about some parameters: `own` (n, q, k), `fixed` (n, p, k), and (n, m, k) of each law.

    `z` (n, k) is the residual with what these columns explain already.
    """

    own: np.ndarray
    fixed: np.ndarray
    of_laws: dict[Pair, np.ndarray]
    z: np.ndarray

    @property
    def each(self) -> list[np.ndarray]:
        """All of them in the order of `Part`."""
        return [self.own, self.fixed, *self.of_laws.values()]


def columns_of(block: Block, points: np.ndarray, shared: np.ndarray, laws: Laws, predicted: np.ndarray,
               pairs: Sequence[Pair]) -> Columns:
    """The columns about these parameters, with those of `pairs`, among which are those of `laws`."""
    own, fixed = block.columns(points, laws, predicted)
    computed = mapped(lambda pair: block.basis(pair, points, laws, predicted), pairs)
    bases = {pair: columns for pair, columns in zip(pairs, computed, strict=True) if columns.shape[1]}
    z = block.measured - predicted + np.einsum("nq,nqk->nk", points, own) + shared @ fixed
    for pair, values in laws:
        if pair in bases:
            z = z + values @ bases[pair]
    return Columns(own, fixed, bases, z)


@dataclass(frozen=True, eq=False)
class Part:
    """What a block brings into a joint linear model: its products `gram`, and `places` of laws among its fixed columns.

    The first `shared` fixed columns are those of its own shared parameters.
    """

    gram: Gram
    shared: int
    places: dict[Pair, np.ndarray]


def part_of(block: Block, columns: Columns, noise: BlockNoise) -> Part:
    """The products of columns."""
    shared = columns.fixed.shape[1]
    ends = shared + np.cumsum([0, *(basis.shape[1] for basis in columns.of_laws.values())])
    gram = gram_of(block, columns.each, columns.z, noise, int(ends[-1] - ends[0]))
    return Part(gram, shared, {pair: np.arange(ends[i], ends[i + 1]) for i, pair in enumerate(columns.of_laws)})


@dataclass(frozen=True, eq=False)
class Further:
    """Products of the columns of a further pair `onto` those of a part and its z (n, m, c), `among` them (n, m, m)."""

    onto: np.ndarray
    among: np.ndarray


def further_of(block: Block, columns: Columns, noise: BlockNoise,
               bases: Mapping[Pair, np.ndarray]) -> dict[Pair, Further]:
    """The products of pairs with columns `bases` (n, m, k), each tried without the others, beside the `columns`."""
    if not bases:
        return {}
    common = sum(group.shape[1] for group in columns.each) + 1
    ends = np.cumsum([basis.shape[1] for basis in bases.values()])
    onto = np.empty((len(columns.z), ends[-1], common))
    among = {pair: np.empty((len(basis), basis.shape[1], basis.shape[1])) for pair, basis in bases.items()}

    def multiply(rows: slice, white: np.ndarray) -> None:
        further = white[:, common:]
        onto[rows] = further @ white[:, :common].transpose(0, 2, 1)
        for square, white_basis in zip(among.values(), np.split(further, ends[:-1], axis=1), strict=True):
            square[rows] = white_basis @ white_basis.transpose(0, 2, 1)

    _each_white(block, [*columns.each, columns.z[:, None], *bases.values()], noise, multiply)
    return {pair: Further(products, among[pair])
            for pair, products in zip(bases, np.split(onto, ends[:-1], axis=1), strict=True)}


@dataclass(frozen=True, eq=False)
class Joint:
    """The `gram` of several parts in which laws have common coefficients at `places`.

    `rows` are the places of each part's own coefficients and of those laws that it has, and `columns` the same among
    the columns of the part.
    """

    gram: Gram
    places: dict[Pair, np.ndarray]
    rows: list[np.ndarray]
    columns: list[np.ndarray]

    def beside(self, pair: Pair, products: Sequence[Further]) -> "Joint":
        """With a further pair that has these `products` in each part."""
        old, first = self.gram.products, len(self.gram.precision)
        size = max(further.among.shape[1] for further in products)
        end = first + size
        wider = np.zeros((len(old), end + 1, end + 1))
        wider[:, :first, :first], wider[:, :first, end] = old[:, :first, :first], old[:, :first, first]
        wider[:, end, :first], wider[:, end, end] = old[:, first, :first], old[:, first, first]
        for further, rows, columns in zip(products, self.rows, self.columns, strict=True):
            places, there = np.arange(first, first + further.among.shape[1]), np.append(rows, end)
            onto = further.onto[:, :, np.append(columns, further.onto.shape[2] - 1)]
            wider[:, places[:, None], there] += onto
            wider[:, there[:, None], places] += onto.transpose(0, 2, 1)
            wider[:, places[:, None], places] += further.among
        precision = np.append(self.gram.precision, np.full(size, LAW_PRECISION))
        gram = replace(self.gram, products=wider, precision=precision, target=np.zeros(end))
        return replace(self, gram=gram, places={**self.places, pair: np.arange(first, end)})


def joined(parts: Sequence[Part], laws: Sequence[Pair]) -> Joint:
    """The joint linear model of several parts, in which `laws` have the same coefficients."""
    if len(parts) == 1 and tuple(parts[0].places) == tuple(laws):  # as it is, without a copy of the products
        own = np.arange(len(parts[0].gram.precision))
        at = {law: parts[0].gram.random + places for law, places in parts[0].places.items()}
        return Joint(parts[0].gram, at, [own], [own])
    random, shared = [part.gram.random for part in parts], [part.shared for part in parts]
    places, first = {}, sum(random) + sum(shared)
    for law in laws:
        size = max((len(part.places[law]) for part in parts if law in part.places), default=0)
        places[law] = np.arange(first, first + size)
        first += size
    products = np.zeros((len(parts[0].gram), first + 1, first + 1))
    precision, rows, columns = np.full(first, LAW_PRECISION), [], []
    for b, part in enumerate(parts):
        own = np.arange(random[b] + shared[b])
        to = np.concatenate([sum(random[:b]) + np.arange(random[b]), sum(random) + sum(shared[:b])
                             + np.arange(shared[b])])
        precision[to] = part.gram.precision[own]
        mine = [law for law in laws if law in part.places]
        columns.append(np.concatenate([own, *(random[b] + part.places[law] for law in mine)]))
        here = np.append(columns[b], part.gram.products.shape[1] - 1)
        rows.append(np.concatenate([to, *(places[law][:len(part.places[law])] for law in mine)]))
        there = np.append(rows[b], first)
        products[:, there[:, None], there] += part.gram.products[:, here[:, None], here]
    widest = np.concatenate([part.gram.widest for part in parts])
    return Joint(Gram(products, sum(random), precision, np.zeros(first), widest), places, rows, columns)
