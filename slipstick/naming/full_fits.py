"""Pairs fitted in full, in all their blocks at once, because a strong law is far from the linearisation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.naming.block import Pair, finest
from slipstick.naming.evidence import Gain
from slipstick.naming.fit import BlockFit, fit_together
from slipstick.naming.selection import Finding, is_finding, leads, priced
from slipstick.naming.settings import NamingSettings

_ROUGH = 1e-4
"""Share of the rise of a pair that a step must bring while pairs are compared: a 300th of what a further pair must add.
"""


@dataclass(frozen=True, eq=False)
class Tried:
    """A pair fitted in full: its priced `rise` (n,) in the likelihood, and the fits of the blocks that it changes.

    They hold where its resolution has been doubled `finer` times in its blocks.
    """

    one: Gain
    rise: np.ndarray
    its: dict[str, BlockFit]
    finer: int

    @property
    def nats(self) -> float:
        """Rise of all engagements in nats."""
        return float(self.rise.sum())

    @property
    def finding(self) -> Finding:
        """What it would be as a finding."""
        blocks, pair = self.one.blocks, self.one.pair
        return Finding(blocks, pair, self.rise, expected=expected_of(self.its, blocks, pair),
                       agreement=self.one.agreement)


def tried(fits: Mapping[str, BlockFit], one: Gain, finer: int) -> Tried:
    """A pair fitted with a resolution that is doubled `finer` times, which its blocks do not keep.

    It is as well as a comparison needs, and `to_the_end` completes it.
    """
    return _fitted(fits, fits, one, finer, _ROUGH)


def to_the_end(fits: Mapping[str, BlockFit], one: Tried) -> Tried:
    """A pair that was tried, with fits that end where no step promises anything."""
    return _fitted(fits, {**fits, **one.its}, one.one, one.finer, 0.0)


def _fitted(fits: Mapping[str, BlockFit], starts: Mapping[str, BlockFit], one: Gain, finer: int,
            rough: float) -> Tried:
    """A pair with the fits, from `starts` on, of its blocks and of those that share a law with one of them."""
    blocks = [fits[name].block for name in one.blocks]
    before = [block.finer for block in blocks]
    for block in blocks:
        block.finer = {**block.finer, one.pair: finer}
    order = sharing(fits, one.blocks)
    laws = [(*fits[name].laws, *([one.pair] if name in one.blocks else [])) for name in order]
    found = fit_together([fits[name].block for name in order], laws, [starts[name] for name in order], rough=rough)
    its = dict(zip(order, found, strict=True))
    price = sum(its[name].leverage(one.pair) for name in one.blocks)
    for block, own in zip(blocks, before, strict=True):
        block.finer = own
    return Tried(one, priced(rise_of(fits, its), np.asarray(price)), its, finer)


def is_enough_with(fits: Mapping[str, BlockFit], its: Mapping[str, BlockFit], one: Finding,
                   settings: NamingSettings) -> bool:
    """Whether a law that changes blocks of `fits` to those of `its` is enough for the finding `one`."""
    before, after = (np.array([some[name].chi2 for name in one.blocks]) for some in (fits, its))
    return is_finding(one.gain, expected_of(its, one.blocks, one.pair), one.agreement, before, after, settings)


def expected_of(its: Mapping[str, BlockFit], blocks: Sequence[str], pair: Pair) -> np.ndarray:
    """Standard errors (n,) in which engagements should show a law that these `blocks` of `its` have."""
    return np.asarray(np.sqrt(np.sum([its[name].expected(pair) ** 2 for name in blocks], axis=0)))


def rise_of(fits: Mapping[str, BlockFit], others: Mapping[str, BlockFit]) -> np.ndarray:
    """By how much the likelihood (n,) of engagements in nats rises from `fits` to the `others` of the same blocks."""
    rises = [one.fitted.likelihood - fits[name].fitted.likelihood for name, one in others.items()]
    return np.asarray(np.sum(rises, axis=0))


def sharing(fits: Mapping[str, BlockFit], blocks: Sequence[str]) -> list[str]:
    """Names of these blocks, and of those that share a law with one of them."""
    names, laws = set(blocks), set[Pair]()
    while True:
        laws |= {law for name in names for law in fits[name].laws}
        wider = names | {name for name, its in fits.items() if laws & set(its.laws)}
        if wider == names:
            return [name for name in fits if name in names]
        names = wider


def finer_fits(fits: Mapping[str, BlockFit], blocks: Sequence[str], settings: NamingSettings,
           further: np.ndarray) -> dict[str, BlockFit] | None:
    """The fits of these blocks with finer laws, if those do as well as a further law that gains `further` (n,).

    What few knots leave of a strong law looks like another one: a further name must explain more than the same laws
    with twice the resolution.
    """
    order = sharing(fits, blocks)
    before = {name: fits[name].block.finer for name in order}
    finer = {law: before[name].get(law, 0) + 1 for name in order for law in fits[name].laws
             if before[name].get(law, 0) < finest(fits[name].block, law)}
    if not finer:
        return None
    for name in order:
        fits[name].block.finer = {**before[name], **{law: finer[law] for law in fits[name].laws if law in finer}}
    starts = [replace(fits[name], coefficients={law: c for law, c in fits[name].coefficients.items()
                                                if law not in finer}) for name in order]
    found = dict(zip(order, fit_together([one.block for one in starts], [one.laws for one in starts], starts),
                     strict=True))
    price = np.sum([one.leverage(law) for one in found.values() for law in one.laws], axis=0)
    paid = np.sum([fits[name].leverage(law) for name in order for law in fits[name].laws], axis=0)
    gain = priced(rise_of(fits, found), price - paid)
    if gain.sum() > settings.nats and not leads(further, gain, settings):
        return found
    for name in order:
        fits[name].block.finer = before[name]
    return None
