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
    """A pair fitted in full: its priced `rise` (n,) in the likelihood, and the `fits` of the blocks that it changes.

    They hold where its resolution has been doubled `finer` times in its blocks. `linear_gain` is what it gains in the
    linear model.
    """

    linear_gain: Gain
    rise: np.ndarray
    fits: dict[str, BlockFit]
    finer: int

    @property
    def nats(self) -> float:
        """Rise of all engagements in nats."""
        return float(self.rise.sum())

    @property
    def finding(self) -> Finding:
        """What it would be as a finding."""
        blocks, pair = self.linear_gain.blocks, self.linear_gain.pair
        return Finding(blocks, pair, self.rise, expected=expected_of(self.fits, blocks, pair),
                       agreement=self.linear_gain.agreement)


def tried(fits: Mapping[str, BlockFit], linear_gain: Gain, finer: int) -> Tried:
    """A pair fitted with a resolution that is doubled `finer` times, which its blocks do not keep.

    It is as well as a comparison needs, and `to_the_end` completes it.
    """
    return _fitted(fits, fits, linear_gain, finer, _ROUGH)


def to_the_end(fits: Mapping[str, BlockFit], trial: Tried) -> Tried:
    """A pair that was tried, with fits that end where no step promises anything."""
    return _fitted(fits, {**fits, **trial.fits}, trial.linear_gain, trial.finer, 0.0)


def _fitted(fits: Mapping[str, BlockFit], starts: Mapping[str, BlockFit], linear_gain: Gain, finer: int,
            rough: float) -> Tried:
    """A pair with the fits, from `starts` on, of its blocks and of those that share a law with one of them."""
    blocks = [fits[name].block for name in linear_gain.blocks]
    before = [block.finer for block in blocks]
    for block in blocks:
        block.finer = {**block.finer, linear_gain.pair: finer}
    order = sharing(fits, linear_gain.blocks)
    laws = [(*fits[name].laws, *([linear_gain.pair] if name in linear_gain.blocks else [])) for name in order]
    refitted = fit_together([fits[name].block for name in order], laws, [starts[name] for name in order], rough=rough)
    changed_fits = dict(zip(order, refitted, strict=True))
    price = sum(changed_fits[name].leverage(linear_gain.pair) for name in linear_gain.blocks)
    for block, own in zip(blocks, before, strict=True):
        block.finer = own
    return Tried(linear_gain, priced(rise_of(fits, changed_fits), np.asarray(price)), changed_fits, finer)


def is_enough_with(fits: Mapping[str, BlockFit], changed_fits: Mapping[str, BlockFit], finding: Finding,
                   settings: NamingSettings) -> bool:
    """Whether a law that changes blocks of `fits` to those of `changed_fits` is enough for the `finding`."""
    before, after = (np.array([block_fits[name].chi2 for name in finding.blocks])
                     for block_fits in (fits, changed_fits))
    return is_finding(finding.gain, expected_of(changed_fits, finding.blocks, finding.pair), finding.agreement,
                      before, after, settings)


def expected_of(fits: Mapping[str, BlockFit], blocks: Sequence[str], pair: Pair) -> np.ndarray:
    """Standard errors (n,) in which engagements should show a law that these `blocks` of `fits` have."""
    return np.asarray(np.sqrt(np.sum([fits[name].expected(pair) ** 2 for name in blocks], axis=0)))


def rise_of(fits: Mapping[str, BlockFit], others: Mapping[str, BlockFit]) -> np.ndarray:
    """By how much the likelihood (n,) of engagements in nats rises from `fits` to the `others` of the same blocks."""
    rises = [fit.fitted.likelihood - fits[name].fitted.likelihood for name, fit in others.items()]
    return np.asarray(np.sum(rises, axis=0))


def sharing(fits: Mapping[str, BlockFit], blocks: Sequence[str]) -> list[str]:
    """Names of these blocks, and of those that share a law with one of them."""
    names, laws = set(blocks), set[Pair]()
    while True:
        laws |= {law for name in names for law in fits[name].laws}
        wider = names | {name for name, fit in fits.items() if laws & set(fit.laws)}
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
    changed_fits = dict(zip(order, fit_together([start.block for start in starts],
                                                [start.laws for start in starts], starts), strict=True))
    price = np.sum([fit.leverage(law) for fit in changed_fits.values() for law in fit.laws], axis=0)
    paid = np.sum([fits[name].leverage(law) for name in order for law in fits[name].laws], axis=0)
    gain = priced(rise_of(fits, changed_fits), price - paid)
    if gain.sum() > settings.nats and not leads(further, gain, settings):
        return changed_fits
    for name in order:
        fits[name].block.finer = before[name]
    return None
