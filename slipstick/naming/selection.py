"""Which pairs of quantity and dependence the recordings ask for, one after the other: forward selection."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipstick.naming.block import Pair
from slipstick.naming.evidence import Gain, Table, gains, table
from slipstick.naming.fit import BlockFit, fit
from slipstick.naming.settings import NamingSettings

Log = Callable[..., None]
FINER = 17
"""Knots of a law in a block that is far off: what few knots leave of a strong law would look like another one."""
_STEPS = 12


@dataclass(frozen=True, eq=False)
class Rival:
    """A pair that is not told apart from the best one: its gain in nats, and by how many standard errors it trails."""

    pair: Pair
    nats: float
    behind: float


@dataclass(frozen=True, eq=False)
class Finding:
    """A pair that `blocks` ask for: `gain` (n,) in nats of each engagement, and the pairs not told apart from it."""

    blocks: tuple[str, ...]
    pair: Pair
    gain: np.ndarray
    rivals: tuple[Rival, ...] = ()

    @property
    def nats(self) -> float:
        """Gain of all engagements in nats."""
        return float(self.gain.sum())

    @property
    def errors(self) -> float:
        """Mean gain in its standard errors over engagements."""
        return in_errors(self.gain)


def in_errors(gain: np.ndarray) -> float:
    """Mean of gains (n,) in its standard errors."""
    deviation = max(float(gain.std(ddof=1)), 1e-12)  # where all are equal, a mean that is not 0 is beyond doubt
    return float(gain.mean()) * float(np.sqrt(len(gain))) / deviation


def is_enough(gain: np.ndarray, settings: NamingSettings) -> bool:
    """Whether a gain (n,) is more than noise and single engagements give."""
    return bool(gain.sum() > settings.nats and in_errors(gain) > settings.errors)


def rivals(best: np.ndarray, others: Sequence[tuple[np.ndarray, Pair]], settings: NamingSettings) -> tuple[Rival, ...]:
    """Those of `others` that would do, and that `best` (n,) leads by too little in nats or in standard errors."""
    found = []
    for gain, pair in others:
        ahead = best - gain
        if is_enough(gain, settings) and (ahead.sum() < settings.nats or in_errors(ahead) < settings.apart):
            found.append(Rival(pair, float(gain.sum()), in_errors(ahead)))
    return tuple(found)


def priced(gain: np.ndarray, size: int) -> np.ndarray:
    """A gain (n,) in maximised log-likelihood less the price of `size` coefficients, as BIC has it."""
    return np.asarray(gain - 0.5 * size * np.log(len(gain)) / len(gain))


def forward(fits: Mapping[str, BlockFit], settings: NamingSettings,
            log: Log = lambda *_: None) -> tuple[dict[str, BlockFit], list[Finding]]:
    """Add pairs to the blocks of `fits` while the recordings ask for them."""
    fits, findings, closed = dict(fits), list[Finding](), set[str]()
    for one in fits.values():
        if one.chi2.mean() > settings.strong:
            one.block.fine = FINER
    for _ in range(settings.most):
        tables = {name: table(one) for name, one in fits.items() if name not in closed}
        if not tables:
            break
        current = list(dict.fromkeys(law for one in fits.values() for law in one.laws))
        offered = dict.fromkeys(pair for one in tables.values() for pair in one.places)
        pairs = [pair for pair in offered if pair not in current]
        ranked = [one for one in gains(list(tables.values()), current, pairs) if is_enough(one.nats, settings)]
        log(_shown(fits), [(" ~ ".join(one.pair), round(float(one.nats.sum()))) for one in ranked[:4]])
        touched = set[str]()
        for best in ranked:
            if touched & set(best.blocks):
                continue
            touched |= set(best.blocks)
            others = [one for one in ranked if one is not best and set(one.blocks) & set(best.blocks)]
            finding, its = _settled(fits, tables, best, others, settings)
            log("   ", " ~ ".join(finding.pair), round(finding.nats), [one.pair for one in finding.rivals])
            earlier = max((one.nats for one in findings if set(one.blocks) & set(its)), default=0.0)
            if not is_enough(finding.gain, settings) or finding.nats < settings.further * earlier:
                closed |= set(best.blocks)
                continue
            touched |= set(its)
            findings.append(finding)
            fits |= its
        if not touched - closed:
            break
    return fits, findings


def _settled(fits: Mapping[str, BlockFit], tables: Mapping[str, Table], best: Gain, others: Sequence[Gain],
             settings: NamingSettings) -> tuple[Finding, dict[str, BlockFit]]:
    """The finding among the best pair and others near it, and the fits of the blocks that it changes.

    Within a block the pairs are fitted anew, because a strong law is far from the linearisation. Where a pair acts on
    several blocks its coefficients are common to them, which only the joint linear model knows: its gains then decide.
    """
    near = [one for one in others if one.nats.sum() > 0.5 * best.nats.sum()
            or in_errors(best.nats - one.nats) < 2 * settings.apart][:settings.rivals]
    tried: list[tuple[np.ndarray, Gain, dict[str, BlockFit]]] = []
    is_joint = len({one.blocks for one in (best, *near)}) > 1 or len(best.blocks) > 1
    def refitted(one: Gain) -> dict[str, BlockFit]:
        return {name: fit(fits[name].block, (*fits[name].laws, one.pair), fits[name], _STEPS) for name in one.blocks}

    for one in (best, *near):
        if is_joint:
            tried.append((one.nats, one, {}))
            continue
        its = refitted(one)
        rise = sum(its[name].fitted.likelihood - fits[name].fitted.likelihood for name in its)
        tried.append((priced(np.asarray(rise), len(tables[one.blocks[0]].places[one.pair])), one, its))
    tried.sort(key=lambda one: -float(one[0].sum()))
    gain, chosen, its = tried[0]
    its = its or refitted(chosen)
    tied = rivals(gain, [(other, one.pair) for other, one, _ in tried[1:]], settings)
    return Finding(chosen.blocks, chosen.pair, gain, tied), its


def _shown(fits: Mapping[str, BlockFit]) -> dict[str, Any]:
    return {name: round(float(one.chi2.mean()), 3) for name, one in fits.items()}
