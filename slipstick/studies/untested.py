"""What is missing where blocks could not be tested, by the simulation of the whole bench alone."""

from collections.abc import Sequence
from typing import NamedTuple

from slipstick.clutch import effects
from slipstick.confirmation.explanations import Explanation, explanations
from slipstick.confirmation.fit import SimulationFit
from slipstick.confirmation.times import TimesOver, times_over
from slipstick.confirmation.traces import TIME
from slipstick.recordings.signals import NEEDED
from slipstick.studies.result import ClosedBlock
from slipstick.studies.settings import StudySettings
from slipstick.studies.words import SIGNALS


class Untested(NamedTuple):
    """The `closed` blocks, the channels in which the simulation has `misfits`, and what would explain these.

    `times` are the changes of the shifting time over conditions, where nothing else was recorded.
    """

    closed: list[ClosedBlock]
    misfits: list[str]
    explanations: list[Explanation]
    times: list[TimesOver]


def closed_blocks(missing: Sequence[str]) -> list[ClosedBlock]:
    """The blocks that could not be tested without the `missing` signals."""
    return [ClosedBlock(block, words, [name for name in missing if name in NEEDED[block]])
            for block, words in SIGNALS.items() if NEEDED[block] & set(missing)]


def examine_untested(settings: StudySettings, after: SimulationFit) -> Untested:
    """What the fit `after` with all findings says about the blocks that could not be tested."""
    closed, known = closed_blocks(after.block.scene.missing), after.block.terms.effects
    signals = after.block.traces.signals
    # A few bad engagements, which the blocks would have shown, are no misfit.
    usual = after.usual_chi_square if closed else dict.fromkeys(signals, 0.0)
    misfits = [name for name in signals if usual[name] > settings.naming.strong]
    if not closed or (signals and not misfits):
        return Untested(closed, misfits, [], [])
    others = [effect for effect in effects.CATALOGUE if effect.name in settings.catalogue and effect.name not in known]
    if signals:
        return Untested(closed, misfits, explanations(after, others, settings.naming), [])
    # The parameters of an engagement explain its one number, so that only differences between conditions tell anything.
    times = times_over(after, settings.naming, settings.seed)
    if not any(change.shown for change in times):
        return Untested(closed, [], [], times)
    return Untested(closed, [TIME], explanations(after, others, settings.naming), times)
