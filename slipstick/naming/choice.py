"""The choice between a pair that gains most in the linear model and those near it, by full fits."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter

import numpy as np

from slipstick.naming.answer import next_best
from slipstick.naming.block import Pair, finest, has_few_numbers
from slipstick.naming.evidence import Gain
from slipstick.naming.fineness import finer_while
from slipstick.naming.fit import BlockFit
from slipstick.naming.full_fits import Tried, is_enough_with, to_the_end, tried
from slipstick.naming.selection import NEAR, Finding, Rival, in_errors, is_enough, is_unexplained, leads, rivals
from slipstick.naming.settings import NamingSettings
from slipstick.naming.varying_lag import with_constant_lag


@dataclass(frozen=True, eq=False)
class Choice:
    """The pairs `compared` in the linear model about `fits`, and those of them that are `ranked`, best first.

    The lead over rare pairs does not count for those that are `usual`: where they are not told apart, they are tied,
    and the usual one comes first.
    `ask` is told which pair is fitted in full. Each is fitted once, and then `known`.
    """

    fits: Mapping[str, BlockFit]
    compared: Sequence[Gain]
    ranked: Sequence[Gain]
    usual: Collection[Pair]
    settings: NamingSettings
    ask: Callable[[Gain], None]
    known: dict[Pair, Tried] = field(default_factory=dict)

    def near(self, best: Gain) -> list[Gain]:
        """Those that a full fit may put before the best one of some blocks in the linear model."""
        others = [one for one in self.ranked if one is not best and set(one.blocks) & set(best.blocks)]
        return [one for one in others if one.nats.sum() > NEAR * best.nats.sum()
                or in_errors(best.nats - one.nats) < 2 * self.settings.apart][:self.settings.rivals]

    def settled(self, best: Gain, near: Sequence[Gain]) -> tuple[Finding, dict[str, BlockFit]]:
        """The finding among the best pair and others `near` it, and the fits of the blocks that it changes.

        Rises of the likelihood are summed over all blocks, where a pair changes nothing in a block that it does not act
        on. A pair that acts on several blocks must do better than pairs of their own: two names are asked for where
        they explain enough more than one. What is chosen in one of these blocks is then chosen without the joint pair.
        """
        those = [self._tried(one) for one in (best, *near)]
        most = max(one.nats for one in those)
        those = [self._finest(one) if one.nats > NEAR * most else one for one in those]
        those.sort(key=attrgetter("nats"), reverse=True)
        # What few engagements show counts only if nothing else of that size is shown.
        large = [one for one in those if one.nats > NEAR * those[0].nats]
        enough = [one for one in large if self._is_enough(one)]
        chosen = self._usual_before_rare(enough) if enough else those[0]
        apart = [self._tried(one) for one in _apart(chosen.one, self.ranked)] if len(chosen.one.blocks) > 1 else []
        if len(apart) > 1 and is_enough(np.sum([one.rise for one in apart], axis=0) - chosen.rise, self.settings):
            own = max([one for one in apart if self._is_enough(one)] or apart, key=attrgetter("nats")).one
            alone = replace(self, ranked=[one for one in self.ranked if one is not chosen.one],
                            known={pair: one for pair, one in self.known.items() if one is not chosen})
            return alone.settled(own, alone.near(own))
        others = [one for one in those if one is not chosen and self._is_enough(one)]
        chosen = to_the_end(self.fits, chosen)
        for name in chosen.one.blocks:
            block = self.fits[name].block
            block.finer = {**block.finer, chosen.one.pair: chosen.finer}
        tied = rivals(chosen.rise, [(one.rise, one.one.pair) for one in others], self.settings)
        finding = replace(chosen.finding, rivals=tied, next_best=self._next_best(chosen),
                          rare=with_constant_lag(chosen.one.pair) not in self.usual)
        more = uneven(finding, self.compared, self.settings)
        return replace(finding, rivals=(*finding.rivals, *more)), chosen.its

    def _usual_before_rare(self, those: Sequence[Tried]) -> Tried:
        """The first of `those`, or where that is a rare pair the first usual one that it does not lead."""
        usual = [one for one in those if one.one.pair in self.usual]
        return next((one for one in usual if not leads(those[0].rise, one.rise, self.settings)), those[0])

    def _tried(self, one: Gain) -> Tried:
        if one.pair not in self.known:
            self.ask(one)
            block = self.fits[one.blocks[0]].block
            found = tried(self.fits, one, block.finer.get(one.pair, 0))
            # An error of a sensor has few numbers, and must compete with the freedom of others.
            most = finest(block, one.pair) if has_few_numbers(one.pair) else 0
            self.known[one.pair] = finer_while(found, most, self._doubled, self.settings.nats)
        return self.known[one.pair]

    def _finest(self, one: Tried) -> Tried:
        """A pair with as many knots as gain more than a share, where it leaves something in its blocks.

        One of few numbers has been tried with more already.
        """
        if not has_few_numbers(one.one.pair) and any(
                is_unexplained(one.its[name].chi2, self.fits[name].chi2, self.settings) for name in one.one.blocks):
            most = finest(self.fits[one.one.blocks[0]].block, one.one.pair)
            self.known[one.one.pair] = finer_while(one, most, self._doubled, self.settings.nats, self.settings.further)
        return self.known[one.one.pair]

    def _doubled(self, one: Tried) -> Tried:
        return tried(self.fits, one.one, one.finer + 1)

    def _is_enough(self, one: Tried) -> bool:
        return is_enough_with(self.fits, one.its, one.finding, self.settings)

    def _next_best(self, chosen: Tried) -> Rival | None:
        """The pair that gains most after the one that was chosen, in its blocks, of those that are another effect.

        The lead over a pair that was not fitted in full is the one in the linear model.
        """
        found = [Rival(pair, one.nats, in_errors(chosen.rise - one.rise))
                 for pair, one in self.known.items()]
        for one in self.compared:
            if one.pair not in self.known and set(one.blocks) <= set(chosen.one.blocks):
                ahead = chosen.one.nats - one.nats
                found.append(Rival(one.pair, float((chosen.rise - ahead).sum()), in_errors(ahead)))
        is_usual = chosen.one.pair in self.usual
        return next_best(chosen.one.pair, [one for one in found if one.pair in self.usual or not is_usual])


def uneven(finding: Finding, compared: Sequence[Gain], settings: NamingSettings) -> list[Rival]:
    """Pairs that gain more than a finding, but not in most engagements: neither can be told to be right."""
    return [Rival(one.pair, float(one.nats.sum()), in_errors(finding.gain - one.nats)) for one in compared
            if set(one.blocks) <= set(finding.blocks) and not is_enough(one.nats, settings)
            and one.nats.sum() > finding.nats + settings.nats]


def _apart(joint: Gain, ranked: Sequence[Gain]) -> list[Gain]:
    """The best pairs of the blocks of a `joint` one that do not share a block with each other."""
    found, taken = list[Gain](), set[str]()
    for one in ranked:
        if one is not joint and set(one.blocks) < set(joint.blocks) and not set(one.blocks) & taken:
            found.append(one)
            taken |= set(one.blocks)
    return found
