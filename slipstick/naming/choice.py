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
        others = [gain for gain in self.ranked if gain is not best and set(gain.blocks) & set(best.blocks)]
        return [gain for gain in others if gain.nats.sum() > NEAR * best.nats.sum()
                or in_errors(best.nats - gain.nats) < 2 * self.settings.apart][:self.settings.rivals]

    def settled(self, best: Gain, near: Sequence[Gain]) -> tuple[Finding, dict[str, BlockFit]]:
        """The finding among the best pair and others `near` it, and the fits of the blocks that it changes.

        Rises of the likelihood are summed over all blocks, where a pair changes nothing in a block that it does not act
        on. A pair that acts on several blocks must do better than pairs of their own: two names are asked for where
        they explain enough more than one. What is chosen in one of these blocks is then chosen without the joint pair.
        """
        trials = [self._try(gain) for gain in (best, *near)]
        most = max(trial.nats for trial in trials)
        trials = [self._refine(trial) if trial.nats > NEAR * most else trial for trial in trials]
        trials.sort(key=attrgetter("nats"), reverse=True)
        # What few engagements show counts only if nothing else of that size is shown.
        large = [trial for trial in trials if trial.nats > NEAR * trials[0].nats]
        enough = [trial for trial in large if self._is_enough(trial)]
        chosen = self._put_usual_before_rare(enough) if enough else trials[0]
        winner = chosen.linear_gain
        apart = [self._try(gain) for gain in _split(winner, self.ranked)] if len(winner.blocks) > 1 else []
        if len(apart) > 1 and is_enough(np.sum([trial.rise for trial in apart], axis=0) - chosen.rise, self.settings):
            own = max([trial for trial in apart if self._is_enough(trial)] or apart, key=attrgetter("nats")).linear_gain
            alone = replace(self, ranked=[gain for gain in self.ranked if gain is not winner],
                            known={pair: trial for pair, trial in self.known.items() if trial is not chosen})
            return alone.settled(own, alone.near(own))
        others = [trial for trial in trials if trial is not chosen and self._is_enough(trial)]
        chosen = to_the_end(self.fits, chosen)
        tied = rivals(chosen.rise, [(trial.rise, trial.linear_gain.pair) for trial in others], self.settings)
        finding = replace(chosen.finding, rivals=tied, next_best=self._next_best(chosen),
                          rare=with_constant_lag(winner.pair) not in self.usual)
        more = find_uneven(finding, self.compared, self.settings)
        return replace(finding, rivals=(*finding.rivals, *more)), chosen.fits

    def _put_usual_before_rare(self, trials: Sequence[Tried]) -> Tried:
        """The first of `trials`, or where that is a rare pair the first usual one that it does not lead."""
        usual = [trial for trial in trials if trial.linear_gain.pair in self.usual]
        return next((trial for trial in usual if not leads(trials[0].rise, trial.rise, self.settings)), trials[0])

    def _try(self, gain: Gain) -> Tried:
        if gain.pair not in self.known:
            self.ask(gain)
            block = self.fits[gain.blocks[0]].block
            trial = tried(self.fits, gain, block.finer.get(gain.pair, 0))
            # An error of a sensor has few numbers, and must compete with the freedom of others.
            most = finest(block, gain.pair) if has_few_numbers(gain.pair) else 0
            self.known[gain.pair] = finer_while(trial, most, self._double, self.settings.nats)
        return self.known[gain.pair]

    def _refine(self, trial: Tried) -> Tried:
        """A pair with as many knots as gain more than a share, where it leaves something in its blocks.

        One of few numbers has been tried with more already.
        """
        pair, blocks = trial.linear_gain.pair, trial.linear_gain.blocks
        if not has_few_numbers(pair) and any(
                is_unexplained(trial.fits[name].chi2, self.fits[name].chi2, self.settings) for name in blocks):
            most = finest(self.fits[blocks[0]].block, pair)
            self.known[pair] = finer_while(trial, most, self._double, self.settings.nats, self.settings.further)
        return self.known[pair]

    def _double(self, trial: Tried) -> Tried:
        return tried(self.fits, trial.linear_gain, trial.finer + 1)

    def _is_enough(self, trial: Tried) -> bool:
        return is_enough_with(self.fits, trial.fits, trial.finding, self.settings)

    def _next_best(self, chosen: Tried) -> Rival | None:
        """The pair that gains most after the one that was chosen, in its blocks, of those that are another effect.

        The lead over a pair that was not fitted in full is the one in the linear model.
        """
        best = chosen.linear_gain
        behind = [Rival(pair, trial.nats, in_errors(chosen.rise - trial.rise)) for pair, trial in self.known.items()]
        for gain in self.compared:
            if gain.pair not in self.known and set(gain.blocks) <= set(best.blocks):
                ahead = best.nats - gain.nats
                behind.append(Rival(gain.pair, float((chosen.rise - ahead).sum()), in_errors(ahead)))
        is_usual = best.pair in self.usual
        return next_best(best.pair, [rival for rival in behind if rival.pair in self.usual or not is_usual])


def find_uneven(finding: Finding, compared: Sequence[Gain], settings: NamingSettings) -> list[Rival]:
    """Pairs that gain more than a finding, but not in most engagements: neither can be told to be right."""
    return [Rival(gain.pair, float(gain.nats.sum()), in_errors(finding.gain - gain.nats)) for gain in compared
            if set(gain.blocks) <= set(finding.blocks) and not is_enough(gain.nats, settings)
            and gain.nats.sum() > finding.nats + settings.nats]


def _split(joint: Gain, ranked: Sequence[Gain]) -> list[Gain]:
    """The best pairs of the blocks of a `joint` one that do not share a block with each other."""
    parts, taken = list[Gain](), set[str]()
    for gain in ranked:
        if gain is not joint and set(gain.blocks) < set(joint.blocks) and not set(gain.blocks) & taken:
            parts.append(gain)
            taken |= set(gain.blocks)
    return parts
