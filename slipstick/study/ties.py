"""What the recordings do not tell apart from an effect that was added, everything else that was added beside it."""

from collections.abc import Sequence

import numpy as np

from slipstick.study import mixed
from slipstick.study.comparison import Comparison
from slipstick.study.mixed import MixedFit
from slipstick.study.ranking import APART, Ranked, at_bound, gained, in_errors, rivals
from slipstick.study.rounds import design
from slipstick.study.settings import StudySettings

Tie = dict[str, MixedFit]
"""Effect -> the fit with it in its place: the added one first."""


def ties(settings: StudySettings, comparison: Comparison, added: Sequence[str], rankings: Sequence[Sequence[Ranked]],
         last: MixedFit) -> list[Tie]:
    """For each of the effects `added`, those tied with it; `rankings` are those of their rounds, `last` their fit.

    Of several, each may have been tied in its own round only because others were still missing: every rival is fitted
    in its place beside all others.
    """
    found = []
    for place, (name, ranking) in enumerate(zip(added, rankings, strict=False)):
        others = [*added[:place], *added[place + 1:]]
        tie = {name: last}
        for one in rivals(ranking, name, others, APART):
            fit = _beside(settings, comparison, others, last, one) if others else one.found
            if in_errors(gained(comparison, fit, last, settings.seed)) < APART and not at_bound(one.effect, fit):
                tie[one.effect] = fit
        found.append(tie)
    return found


def _beside(settings: StudySettings, comparison: Comparison, others: Sequence[str], last: MixedFit,
            rival: Ranked) -> MixedFit:
    """The fit with a rival beside the `others`, from where `last` is with another in its place."""
    own = rival.found.design.part(rival.found.state.theta, [rival.effect])[len(settings.parameters):]
    start = np.concatenate([last.design.part(last.state.theta, others), own])
    return mixed.fit(comparison, design(settings, comparison, *others, rival.effect), start, profiled=False)
