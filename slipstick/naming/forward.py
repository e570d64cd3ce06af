"""Which pairs of quantity and dependence the recordings ask for: forward selection, and then backward."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.naming.answer import next_best
from slipstick.naming.asked import Ask, Asked, Step
from slipstick.naming.block import NOT_FINER, Pair, finest
from slipstick.naming.evidence import Gain, Table, gains, table
from slipstick.naming.fit import BlockFit, fit_together
from slipstick.naming.selection import (
    Finding,
    Rival,
    in_agreement,
    in_errors,
    is_enough,
    is_finding,
    is_shown,
    is_unexplained,
    lacks,
    leads,
    priced,
    rivals,
)
from slipstick.naming.settings import NamingSettings
from slipstick.threads import mapped


def forward(fits: Mapping[str, BlockFit], settings: NamingSettings, ask: Ask = lambda _: None, step: Step = "laws",
            closed: Collection[str] = ()) -> tuple[dict[str, BlockFit], list[Finding]]:
    """Add pairs to the blocks of `fits` but those `closed` while the recordings ask for them, as a `step` of naming."""
    fits, findings, closed = dict(fits), list[Finding](), set(closed)
    _set_resolution(fits, settings)
    tables: dict[str, Table] = {}
    while len(closed) < len(fits):
        asked = tuple(name for name in fits if name not in closed)
        ask(Asked(step, asked, compares=True))
        changed = [name for name in asked if name not in tables or tables[name].fit is not fits[name]]
        tables |= dict(zip(changed, mapped(table, [fits[name] for name in changed]), strict=True))
        tables = {name: tables[name] for name in asked}
        current = list(dict.fromkeys(law for one in fits.values() for law in one.laws))
        offered = dict.fromkeys(pair for one in tables.values() for pair in one.places)
        pairs = [pair for pair in offered if pair not in current]
        compared = gains(list(tables.values()), current, pairs)
        ranked = [one for one in compared
                  if is_enough(one.nats, settings) or is_shown(one.nats, one.expected, settings)]
        if not ranked:
            off = {name for name, one in fits.items() if lacks(one.chi2, settings)}
            ranked = [one for one in compared if off & set(one.blocks) and _agrees(one, settings)]
        touched = set[str]()
        for best in ranked:
            others = [one for one in ranked if one is not best and set(one.blocks) & set(best.blocks)]
            near = _near(best, others, settings)
            # What competes with a pair in a block that has changed is compared about the new fit, in the next round.
            if touched & {block for one in (best, *near) for block in one.blocks}:
                continue
            finding, its = _settled(fits, best, near, compared, ranked, settings,
                                    lambda one: ask(Asked(step, one.blocks, one.pair)))
            finding = replace(finding, rivals=(*finding.rivals, *_uneven(finding, compared, settings)))
            finer = _finer(fits, finding.blocks, settings, finding.gain)
            touched |= set(best.blocks) | set(finer or its)
            if finer is not None:
                fits |= finer
                continue
            earlier = max((one.nats for one in findings if set(one.blocks) & set(finding.blocks)), default=0.0)
            enough = _is_enough_with(fits, its, finding.blocks, finding.pair, finding.gain, settings)
            if not enough or finding.nats < settings.further * earlier:
                closed |= set(best.blocks)
                continue
            findings.append(finding)
            fits |= its
            closed |= {name for name in finding.blocks if len(fits[name].laws) >= settings.most}
        if not touched:
            break
    return _backward(fits, findings, settings)


def _backward(fits: Mapping[str, BlockFit], findings: Sequence[Finding],
              settings: NamingSettings) -> tuple[dict[str, BlockFit], list[Finding]]:
    """Without those findings whose loss later ones make good: the earlier first, because it was chosen without them."""
    fits, kept = dict(fits), list(findings)
    for finding in findings:
        later = kept[kept.index(finding) + 1:]
        if not any(set(one.blocks) & set(finding.blocks) for one in later):
            continue
        order = _sharing(fits, finding.blocks)
        laws = [tuple(law for law in fits[name].laws if law != finding.pair) for name in order]
        found = dict(zip(order, fit_together([fits[name].block for name in order], laws,
                                             [fits[name] for name in order]), strict=True))
        price = np.sum([fits[name].leverage(finding.pair) for name in finding.blocks], axis=0)
        if not _is_enough_with(found, fits, finding.blocks, finding.pair, priced(-_rise(fits, found), price),
                               settings):
            fits |= found
            kept.remove(finding)
    return fits, kept


def _agrees(one: Gain, settings: NamingSettings) -> bool:
    """Whether a pair gains enough nats in a direction in which engagements agree, each of a size of its own.

    The linear model of a strong law may gain in few engagements although the law itself gains in most.
    """
    return bool(one.nats.sum() > settings.nats and in_agreement(one.scores) > settings.errors)


def _is_enough_with(fits: Mapping[str, BlockFit], its: Mapping[str, BlockFit], blocks: Sequence[str], pair: Pair,
                    gain: np.ndarray, settings: NamingSettings) -> bool:
    """Whether a law that changes `blocks` of `fits` to those of `its` and gains (n,) nats is enough for a finding."""
    before, after = (np.array([some[name].chi2 for name in blocks]) for some in (fits, its))
    return is_finding(gain, _expected(its, blocks, pair), before, after, settings)


def _expected(its: Mapping[str, BlockFit], blocks: Sequence[str], pair: Pair) -> np.ndarray:
    """Standard errors (n,) in which engagements should show a law that these `blocks` of `its` have."""
    return np.asarray(np.sqrt(np.sum([its[name].expected(pair) ** 2 for name in blocks], axis=0)))


def _set_resolution(fits: Mapping[str, BlockFit], settings: NamingSettings) -> None:
    """More knots in blocks that are not explained, and then more columns of errors of sensors in all blocks."""
    blocks = [one.block for one in fits.values()]
    off = [one.block for one in fits.values() if is_unexplained(one.chi2, one.chi2, settings)]
    for block in off:
        block.fine = settings.finer_knots
    if off:
        for block in blocks:
            block.finer = {pair: 1 for pair in block.pairs() if _is_fault(pair)}


def _uneven(finding: Finding, compared: Sequence[Gain], settings: NamingSettings) -> list[Rival]:
    """Pairs that gain more than a finding, but not in most engagements: neither can be told to be right."""
    return [Rival(one.pair, float(one.nats.sum()), in_errors(finding.gain - one.nats)) for one in compared
            if set(one.blocks) <= set(finding.blocks) and not is_enough(one.nats, settings)
            and one.nats.sum() > finding.nats + settings.nats]


def _near(best: Gain, others: Sequence[Gain], settings: NamingSettings) -> list[Gain]:
    """Those of `others` that a full fit may put before the best one of the linear model."""
    return [one for one in others if one.nats.sum() > 0.5 * best.nats.sum()
            or in_errors(best.nats - one.nats) < 2 * settings.apart][:settings.rivals]


@dataclass(frozen=True, eq=False)
class _Tried:
    """A pair fitted in full: its priced `rise` (n,) in the likelihood, and the fits of the blocks that it changes.

    They hold where its resolution has been doubled `finer` times in its blocks.
    """

    one: Gain
    rise: np.ndarray
    its: dict[str, BlockFit]
    finer: int


def _settled(fits: Mapping[str, BlockFit], best: Gain, near: Sequence[Gain], compared: Sequence[Gain],
             ranked: Sequence[Gain], settings: NamingSettings,
             ask: Callable[[Gain], None]) -> tuple[Finding, dict[str, BlockFit]]:
    """The finding among the best pair and others `near` it, and the fits of the blocks that it changes.

    Every pair is fitted anew in all its blocks at once, because a strong law is far from the linearisation. Rises of
    the likelihood are summed over all blocks, where a pair changes nothing in a block that it does not act on. A pair
    that acts on several blocks must do better than pairs of their own: two names are asked for where they explain
    enough more than one.
    """
    known: dict[Pair, _Tried] = {}

    def tried(one: Gain) -> _Tried:
        if one.pair not in known:
            ask(one)
            known[one.pair] = found = _tried(fits, one, fits[one.blocks[0]].block.finer.get(one.pair, 0))
            # An error of a sensor has few numbers. Where it is strong, it must compete with the freedom of others.
            most = finest(fits[one.blocks[0]].block, one.pair) if _is_fault(one.pair) else 0
            while found.finer < most and settings.further * found.rise.sum() > settings.nats:
                finer = _tried(fits, one, found.finer + 1)
                if not is_enough(finer.rise - found.rise, settings):
                    break
                known[one.pair] = found = finer
        return known[one.pair]

    those = sorted((tried(one) for one in (best, *near)), key=lambda one: -float(one.rise.sum()))
    chosen = those[0]
    apart = [tried(one) for one in _apart(chosen.one, ranked)] if len(chosen.one.blocks) > 1 else []
    if len(apart) > 1 and is_enough(np.sum([one.rise for one in apart], axis=0) - chosen.rise, settings):
        chosen = max(apart, key=lambda one: float(one.rise.sum()))
        those = [one for one in those if set(one.one.blocks) <= set(chosen.one.blocks) and one is not chosen]
    else:
        those = those[1:]
    others = [one for one in those
              if _is_enough_with(fits, one.its, one.one.blocks, one.one.pair, one.rise, settings)]
    tied = rivals(chosen.rise, [(other.rise, other.one.pair) for other in others], settings)
    for name in chosen.one.blocks:
        fits[name].block.finer = {**fits[name].block.finer, chosen.one.pair: chosen.finer}
    second = _next_best(chosen, list(known.values()), compared)
    expected = _expected(chosen.its, chosen.one.blocks, chosen.one.pair)
    return Finding(chosen.one.blocks, chosen.one.pair, chosen.rise, tied, second, expected), chosen.its


def _next_best(chosen: _Tried, tried: Sequence[_Tried], compared: Sequence[Gain]) -> Rival | None:
    """The pair that gains most after the one that was chosen, in its blocks, of those that are another effect.

    The lead over a pair that was not fitted in full is the one in the linear model.
    """
    fitted = {one.one.pair for one in tried}
    found = [Rival(one.one.pair, float(one.rise.sum()), in_errors(chosen.rise - one.rise)) for one in tried]
    for one in compared:
        if one.pair not in fitted and set(one.blocks) <= set(chosen.one.blocks):
            ahead = chosen.one.nats - one.nats
            found.append(Rival(one.pair, float((chosen.rise - ahead).sum()), in_errors(ahead)))
    return next_best(chosen.one.pair, found)


def _is_fault(pair: Pair) -> bool:
    """Whether a pair is an error of a sensor, a lag or a memory, whose law has few numbers but can be finer."""
    return pair not in NOT_FINER and (pair[1] in ("lag", "past current") or (pair[0].endswith("sensor")
                                      and pair[1] in ("gain", "time")))


def _tried(fits: Mapping[str, BlockFit], one: Gain, finer: int) -> _Tried:
    """A pair fitted with a resolution that is doubled `finer` times, which its blocks do not keep."""
    blocks = [fits[name].block for name in one.blocks]
    before = [block.finer for block in blocks]
    for block in blocks:
        block.finer = {**block.finer, one.pair: finer}
    its = _fitted(fits, one)
    price = sum(its[name].leverage(one.pair) for name in one.blocks)
    for block, own in zip(blocks, before, strict=True):
        block.finer = own
    return _Tried(one, priced(_rise(fits, its), np.asarray(price)), its, finer)


def _rise(fits: Mapping[str, BlockFit], others: Mapping[str, BlockFit]) -> np.ndarray:
    """By how much the likelihood (n,) of engagements in nats rises from `fits` to the `others` of the same blocks."""
    rises = [one.fitted.likelihood - fits[name].fitted.likelihood for name, one in others.items()]
    return np.asarray(np.sum(rises, axis=0))


def _apart(joint: Gain, ranked: Sequence[Gain]) -> list[Gain]:
    """The best pairs of the blocks of a `joint` one that do not share a block with each other."""
    found, taken = list[Gain](), set[str]()
    for one in ranked:
        if one is not joint and set(one.blocks) < set(joint.blocks) and not set(one.blocks) & taken:
            found.append(one)
            taken |= set(one.blocks)
    return found


def _fitted(fits: Mapping[str, BlockFit], one: Gain) -> dict[str, BlockFit]:
    """The fits of the blocks that a further pair changes: its own, and those that share a law with one of them."""
    order = _sharing(fits, one.blocks)
    its = [(*fits[name].laws, *([one.pair] if name in one.blocks else [])) for name in order]
    found = fit_together([fits[name].block for name in order], its, [fits[name] for name in order])
    return dict(zip(order, found, strict=True))


def _sharing(fits: Mapping[str, BlockFit], blocks: Sequence[str]) -> list[str]:
    """Names of these blocks, and of those that share a law with one of them."""
    names, laws = set(blocks), set[Pair]()
    while True:
        laws |= {law for name in names for law in fits[name].laws}
        wider = names | {name for name, its in fits.items() if laws & set(its.laws)}
        if wider == names:
            return [name for name in fits if name in names]
        names = wider


def _finer(fits: Mapping[str, BlockFit], blocks: Sequence[str], settings: NamingSettings,
           further: np.ndarray) -> dict[str, BlockFit] | None:
    """The fits of these blocks with finer laws, if those do as well as a further law that gains `further` (n,).

    What few knots leave of a strong law looks like another one: a further name must explain more than the same laws
    with twice the resolution.
    """
    order = _sharing(fits, blocks)
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
    gain = priced(_rise(fits, found), price - paid)
    if is_enough(gain, settings) and not leads(further, gain, settings):
        return found
    for name in order:
        fits[name].block.finer = before[name]
    return None
