"""What the recordings do not tell apart from an effect that was added, everything else that was added beside it."""

from collections.abc import Sequence

import numpy as np

from slipstick.study import mixed
from slipstick.study.comparison import Comparison
from slipstick.study.mixed import MixedFit
from slipstick.study.ranking import APART, Ranked, at_bound, gained, in_errors
from slipstick.study.rounds import design
from slipstick.study.settings import StudySettings

Tie = dict[str, MixedFit]
"""Effect -> the fit with it in its place: the added one first."""


def ties(settings: StudySettings, comparison: Comparison, added: Sequence[str], rankings: Sequence[Sequence[Ranked]],
         last: MixedFit, refuted: Sequence[str]) -> list[Tie]:
    """For each of the effects `added`, those tied with it; `rankings` are those of their rounds, `last` their fit.

    Of several, each may have been tied in its own round only because others were still missing: every rival is fitted
    in its place beside all others. `refuted` are no rivals: they were added too, or begun with in vain.
    """
    found = []
    for place, (name, ranking) in enumerate(zip(added, rankings, strict=False)):
        group = {one.effect: one.found for one in ranking if one.tied}
        rivals = {rival: fit for rival, fit in group.items() if rival not in refuted} if name in group else {}
        if rivals and len(added) > 1:
            others = [*added[:place], *added[place + 1:]]
            rivals = _beside(settings, comparison, others, last, rivals)
        found.append({name: group.get(name, last), **rivals})
    return found


def _beside(settings: StudySettings, comparison: Comparison, others: Sequence[str], last: MixedFit,
            rivals: Tie) -> Tie:
    """Of rivals those that, beside the `others`, predict as well as the fit `last`, and are not at a bound."""
    tied, d = {}, len(settings.parameters)
    beside = last.design.of_each(last.state.theta)
    for rival, fit in rivals.items():
        own = fit.design.of_each(fit.state.theta)[rival]
        start = np.concatenate([last.state.theta[:d], *(beside[its] for its in others), own])
        found = mixed.fit(comparison, design(settings, *others, rival), start, profiled=False)
        behind = in_errors(gained(comparison, found, last, settings.seed))
        if behind < APART and not at_bound(rival, found):
            tied[rival] = found
    return tied
