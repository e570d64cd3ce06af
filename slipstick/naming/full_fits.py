"""Pairs fitted in full, in all their blocks at once, because a strong law is far from the linearisation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.naming.block import Pair, twice_as_fine
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

    `linear_gain` is what it gains in the linear model.
    """

    linear_gain: Gain
    rise: np.ndarray
    fits: dict[str, BlockFit]

    @property
    def finer(self) -> int:
        """How many times its resolution is doubled."""
        return self.fits[self.linear_gain.blocks[0]].block.finer[self.linear_gain.pair]

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
    """A pair fitted with a resolution that is doubled `finer` times, as well as a comparison needs.

    The fits are those of its blocks and of others that share a law with one of them; `to_the_end` completes them.
    """
    starts = {name: fits[name].resolved({linear_gain.pair: finer} if name in linear_gain.blocks else {})
              for name in sharing(fits, linear_gain.blocks)}
    return _fitted(fits, starts, linear_gain, _ROUGH)


def to_the_end(fits: Mapping[str, BlockFit], trial: Tried) -> Tried:
    """A pair that was tried, with fits that end where no step promises anything."""
    return _fitted(fits, trial.fits, trial.linear_gain, 0.0)


def _fitted(fits: Mapping[str, BlockFit], starts: Mapping[str, BlockFit], linear_gain: Gain, rough: float) -> Tried:
    """A pair that is added to `fits`, from `starts` on."""
    pair, names = linear_gain.pair, linear_gain.blocks
    laws = {name: (*fits[name].laws, *([pair] if name in names else [])) for name in starts}
    changed_fits = refitted(starts, laws, rough)
    price = sum(changed_fits[name].leverage(pair) for name in names)
    return Tried(linear_gain, priced(rise_of(fits, changed_fits), np.asarray(price)), changed_fits)


def refitted(starts: Mapping[str, BlockFit], laws: Mapping[str, tuple[Pair, ...]],
             rough: float = 0.0) -> dict[str, BlockFit]:
    """The fits of several blocks together, from `starts` on, with `laws` each."""
    fits = fit_together([start.block for start in starts.values()], [laws[name] for name in starts],
                        list(starts.values()), rough=rough)
    return dict(zip(starts, fits, strict=True))


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
    coarse = {name: fits[name] for name in sharing(fits, blocks)}
    finer = {law: times for fit in coarse.values() for law, times in twice_as_fine(fit.block, fit.laws).items()}
    if not finer:
        return None
    starts = {name: replace(fit.resolved({law: finer[law] for law in fit.laws if law in finer}),
                            coefficients={law: c for law, c in fit.coefficients.items() if law not in finer})
              for name, fit in coarse.items()}
    changed_fits = refitted(starts, {name: fit.laws for name, fit in coarse.items()})
    price, paid = (np.sum([fit.leverage(law) for fit in each.values() for law in fit.laws], axis=0)
                   for each in (changed_fits, coarse))
    gain = priced(rise_of(fits, changed_fits), price - paid)
    return changed_fits if gain.sum() > settings.nats and not leads(further, gain, settings) else None
