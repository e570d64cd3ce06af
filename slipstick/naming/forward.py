"""Which pairs of quantity and dependence the recordings ask for: forward selection, and then backward."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from slipstick.naming.asked import Ask, Asked, Step
from slipstick.naming.block import Block, Pair, changed, finer_at_first, is_changing_delay
from slipstick.naming.choice import Choice
from slipstick.naming.evidence import Gain, Table, gains, table
from slipstick.naming.fit import BlockFit
from slipstick.naming.full_fits import finer_fits, is_enough_with, refitted, rise_of, sharing
from slipstick.naming.released import contest, correct, release
from slipstick.naming.selection import (
    Finding,
    is_enough,
    is_shown,
    is_unexplained,
    priced,
)
from slipstick.naming.settings import NamingSettings
from slipstick.numerics.threads import mapped


def forward(fits: Mapping[str, BlockFit], settings: NamingSettings, ask: Ask = lambda _: None, step: Step = "laws",
            closed: Collection[str] = ()) -> tuple[dict[str, BlockFit], list[Finding]]:
    """Add pairs to the blocks of `fits` but those `closed` while the recordings ask for them, as a `step` of naming."""
    fits, findings, closed = _resolved(fits, settings), list[Finding](), set(closed)
    tables, offered = dict[str, Table](), {name: fit.block.pairs() for name, fit in fits.items()}
    usual = {pair for pairs in offered.values() for pair in pairs}
    while len(closed) < len(fits):
        asked = tuple(name for name in fits if name not in closed)
        ask(Asked(step, asked, compares=True))
        tables = _tables({name: fits[name] for name in asked}, offered, tables)
        current = list(dict.fromkeys(law for fit in fits.values() for law in fit.laws))
        known = dict.fromkeys(pair for block_table in tables.values() for pair in block_table.further)
        compared = gains(list(tables.values()), current, [pair for pair in known if pair not in current])
        named = {name for name in asked if fits[name].laws}
        promising = [gain for gain in compared if _is_promising(gain, not named & set(gain.blocks), settings)]
        lacking = _lacking(promising, usual, {name: fits[name] for name in asked}, settings)
        further = _rare(lacking, {name: fits[name].block for name in asked}, offered)
        if further:
            # Something is missing: pairs that hardly any bench has compete as well.
            offered |= {name: [*offered[name], *rare] for name, rare in further.items()}
            continue
        compared, ranked = ([gain for gain in candidates if _may_compete(gain, usual, lacking, fits)]
                            for candidates in (compared, promising))
        shown = [gain for gain in ranked if _is_shown(gain, settings)]
        touched = set[str]()
        for best in shown or ranked[:1]:  # what only agrees is tried one at a time
            choice = Choice(fits, compared, ranked, usual, settings,
                            lambda gain: ask(Asked(step, gain.blocks, gain.pair)))
            near = choice.near(best)
            # What competes with a pair in a block that has changed is compared about the new fit, in the next round.
            if touched & {block for gain in (best, *near) for block in gain.blocks}:
                continue
            answer = _answer(choice, best, near, findings)
            fits |= answer.fits
            touched |= {*best.blocks, *answer.fits}
            closed.update(answer.closed)
            findings += answer.findings
        if not touched:
            break
    fits, findings = _backward(fits, findings, settings)
    return correct(fits, settings), findings


class _Answer(NamedTuple):
    """What comes of a pair: the `fits` of the blocks that it concerns, those that are `closed`, and a finding."""

    fits: Mapping[str, BlockFit]
    closed: Collection[str] = ()
    findings: Sequence[Finding] = ()


def _answer(choice: Choice, best: Gain, near: Sequence[Gain], findings: Sequence[Finding]) -> _Answer:
    """Finer laws in the blocks of the `best` pair or of what is chosen among those `near` it, or its name, or none."""
    fits, settings = choice.fits, choice.settings
    blocks, gain, chosen_fits, finding = best.blocks, best.nats, dict[str, BlockFit](), None
    own = all(set(other.blocks) <= set(blocks) for other in near)
    if not own or _left([fits[name] for name in blocks]) >= _least(blocks, findings, settings):
        finding, chosen_fits = choice.settled(best, near)
        blocks, gain, pair = finding.blocks, finding.gain, finding.pair
        # With the resolution that the pair needs it is tried again, if it is not named now.
        fits = {**fits, **{name: fits[name].resolved({pair: chosen_fits[name].block.finer[pair]}) for name in blocks}}
    finer = finer_fits(fits, blocks, settings, gain)
    if finer is not None:
        return _Answer(finer)
    if finding is None or not is_enough_with(fits, chosen_fits, finding, settings) or (
            finding.nats < _least(blocks, findings, settings)):
        return _Answer({name: fits[name] for name in chosen_fits}, best.blocks)
    released = release(choice.fits, blocks)
    if released is not None:
        finding = contest(finding, released, settings)
        if finding is None:  # the same pairs are compared about freed parameters, in the next round
            return _Answer(released.fits)
    return _Answer(chosen_fits, [name for name in blocks if len(chosen_fits[name].laws) >= settings.most], [finding])


def _least(blocks: Collection[str], findings: Sequence[Finding], settings: NamingSettings) -> float:
    """Nats that a further pair in some `blocks` must gain: a share of what the best one there has gained."""
    return settings.further * max((finding.nats for finding in findings if set(finding.blocks) & set(blocks)),
                                  default=0.0)


def _left(fits: Sequence[BlockFit]) -> float:
    """Nats that a law would gain in some blocks that left nothing but noise."""
    return 0.5 * sum(float(fit.excess.sum()) for fit in fits)


def lacks_something(fit: BlockFit, settings: NamingSettings) -> bool:
    """Whether a block is not explained without laws, or a usual pair promises something in it."""
    if is_unexplained(fit.chi2, fit.chi2, settings):
        return True
    block_table = table(fit, fit.block.pairs())
    return any(_is_promising(gain, True, settings) for gain in gains([block_table], (), list(block_table.further)))


def _tables(fits: Mapping[str, BlockFit], offered: Mapping[str, Sequence[Pair]],
            before: Mapping[str, Table]) -> dict[str, Table]:
    """The tables of fits with what is `offered`: those `before` where the fit is the same, with further pairs."""
    known = {name: block_table for name, block_table in before.items()
             if name in fits and block_table.fit.fitted is fits[name].fitted}
    stale = [name for name in fits if name not in known or len(offered[name]) > len(known[name].asked)]
    made = mapped(lambda name: table(fits[name], offered[name], known.get(name)), stale)
    tables = known | dict(zip(stale, made, strict=True))
    return {name: tables[name] for name in fits}  # in the order of the blocks


def _backward(fits: Mapping[str, BlockFit], findings: Sequence[Finding],
              settings: NamingSettings) -> tuple[dict[str, BlockFit], list[Finding]]:
    """Without those findings whose loss later ones make good: the earlier first, because it was chosen without them."""
    fits, kept = dict(fits), list(findings)
    for finding in findings:
        later = kept[kept.index(finding) + 1:]
        if not any(set(other.blocks) & set(finding.blocks) for other in later):
            continue
        starts = {name: fits[name] for name in sharing(fits, finding.blocks)}
        fits_without = refitted(starts, {name: tuple(law for law in start.laws if law != finding.pair)
                                         for name, start in starts.items()})
        price = np.sum([fits[name].leverage(finding.pair) for name in finding.blocks], axis=0)
        beside = replace(finding, gain=priced(-rise_of(fits, fits_without), price))
        if not is_enough_with(fits_without, fits, beside, settings):
            fits |= fits_without
            kept.remove(finding)
    return fits, kept


def _lacking(promising: Sequence[Gain], usual: Collection[Pair], fits: Mapping[str, BlockFit],
             settings: NamingSettings) -> set[str]:
    """The blocks in which a rare pair may compete: for which alone a `usual` one promises something, or unexplained.

    Otherwise a rare pair would be named for what hardly matters, such as what is left of an error of the converter.
    Pairs of several blocks may promise something in one of them only.
    """
    promised = {gain.blocks[0] for gain in promising if gain.pair in usual and len(gain.blocks) == 1}
    return promised | {name for name, fit in fits.items() if is_unexplained(fit.chi2, fit.chi2, settings)}


def _rare(lacking: Collection[str], blocks: Mapping[str, Block],
          offered: Mapping[str, Collection[Pair]]) -> dict[str, list[Pair]]:
    """The rare pairs of those blocks that are `lacking` beside what is `offered`, for each block that they act on."""
    wanted = {pair for name in lacking for pair in blocks[name].pairs(rare=True)}
    further = {name: [pair for pair in block.pairs(rare=True) if pair in wanted and pair not in offered[name]]
               for name, block in blocks.items()}
    return {name: pairs for name, pairs in further.items() if pairs}


def _may_compete(gain: Gain, usual: Collection[Pair], lacking: Collection[str], fits: Mapping[str, BlockFit]) -> bool:
    """Whether a pair is `usual`, or acts on one of the blocks that are `lacking`.

    A delay that changes is much like a lag of the sensor: beside another law it only follows what few numbers leave of
    that.
    """
    if is_changing_delay(gain.pair, fits[gain.blocks[0]].block.scene) and fits[gain.blocks[0]].laws:
        return False
    return gain.pair in usual or bool(set(lacking) & set(gain.blocks))


def _is_shown(gain: Gain, settings: NamingSettings) -> bool:
    """Whether a pair gains enough in the linear model."""
    return is_enough(gain.nats, settings) or is_shown(gain.nats, gain.expected, gain.agreement, settings)


def _is_promising(gain: Gain, is_first: bool, settings: NamingSettings) -> bool:
    """Whether a pair gains enough in the linear model, or enough nats in a direction in which engagements agree.

    The linear model of a strong law, or one that few knots do not follow, may gain in few engagements although the law
    gains in most. What the first law of a block leaves agrees as well: a further one must do so beyond doubt.
    """
    agreed = gain.agreement > (settings.apart if is_first else settings.errors)
    return _is_shown(gain, settings) or bool(gain.nats.sum() > settings.nats and agreed)


def _resolved(fits: Mapping[str, BlockFit], settings: NamingSettings) -> dict[str, BlockFit]:
    """With more knots in blocks that are not explained, and then more columns of errors of sensors in all blocks."""
    off, resolved = {name for name, fit in fits.items() if is_unexplained(fit.chi2, fit.chi2, settings)}, dict(fits)
    for name, fit in fits.items() if off else ():
        finer = {pair: finer_at_first(pair, settings.finer_knots) for pair in fit.block.pairs()}
        block = changed(fit.block, finer={pair: times for pair, times in finer.items() if times})
        resolved[name] = replace(fit, block=changed(block, fine=settings.finer_knots) if name in off else block)
    return resolved
