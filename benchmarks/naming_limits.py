"""The naming limit of a hidden effect: from which strength on its recordings can tell it from every other law.

An oracle answers that knows which effect is hidden, and everything about it but its size. It sees the effect alone, in
signals without noise, and compares what the right law and the best other law of the same blocks would gain in signals
with the noise of the case, with all parameters free in every engagement. The expected gain of a log-likelihood is its
gain without noise, if residuals are weighted by the noise of the recordings. It grows with the square of the strength,
and 12.5 nats are five standard errors: the naming limit. Detection, against no law at all, is not discrimination, and
has a smaller limit.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.benches import BENCHES
from slipstick.naming.block import Block, Pair
from slipstick.naming.closing_fits import changing_lags, fits_with_pairs, shows_closing
from slipstick.naming.evidence import gains, table
from slipstick.naming.fit import fit
from slipstick.naming.restarts import evidence_of, settled
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from slipstick.naming.start import begin
from slipstick.naming.valve import ValveBlock
from slipstick.naming.varying_lag import with_constant_lag
from slipstick.recordings import Recordings, Signals
from tests.validation.hidden import files
from tests.validation.hidden.case import Case, bad_runs_of, simulate

FIVE_ERRORS = 12.5
"""Nats of a difference of five standard errors."""


@dataclass(frozen=True)
class Told:
    """Strength of an effect in units of the limits from which it is `seen`, and told from other laws: `named`."""

    seen: float
    named: float


def told(case: Case, name: str, same: Collection[Pair]) -> Told:
    """The limits of the hidden effect `name` of a `case`, which a law of any of the pairs `same` describes."""
    scene = without_noise(replace(case, effects={name: case.effects[name]}))
    valve = fit(ValveBlock(scene))
    # An effect of the valve is compared there; the blocks behind it are begun for others only, which takes minutes.
    start = None if set(valve.block.pairs(rare=True)) & set(same) else begin(scene, lambda *_: None)
    found = []
    for fits in [[valve]] if start is None else [[valve], list(start.fits.values())]:
        tables = [table(one, [*one.block.pairs(), *_changing(one.block, same)]) for one in fits]
        pairs = list(dict.fromkeys(pair for one in tables for pair in one.further))
        found += [(one.pair, one.blocks, float(one.nats.sum())) for one in gains(tables, [], pairs)]
    if any(shows_closing(pair) for pair in same):
        assert start is not None
        assert start.closing is not None
        block, onset = start.closing.block, start.closing.onset
        plain = settled(block, onset.points, onset.shared)
        asked = [*filter(shows_closing, block.pairs()), *_changing(block, same)]
        found += [(linear.pair, ("clutch",), evidence_of(one) - evidence_of(plain))
                  for linear, one in fits_with_pairs(block, plain, scene.settings, asked)]
    same = {pair for pair, _, _ in found if with_constant_lag(pair) in same}
    right = max((one for one in found if one[0] in same), key=lambda one: one[2], default=None)
    if right is None:
        return Told(in_limits(max(nats for _, _, nats in found)), 0.0)
    others = [nats for pair, blocks, nats in found if pair not in same and set(blocks) & set(right[1])]
    return Told(in_limits(right[2]), in_limits(right[2] - max([0.0, *others])))


def _changing(block: Block, same: Collection[Pair]) -> list[Pair]:
    """The lags that change of a block, if they are the effect that any of the pairs `same` names."""
    return [pair for pair in changing_lags(block) if with_constant_lag(pair) in same]


def without_noise(case: Case) -> Scene:
    """The good engagements of a case without noise, with what the blocks of its recordings say of the noise."""
    bench = BENCHES[case.bench]
    with TemporaryDirectory() as folder:
        files.write(Path(folder) / "case.h5", case, relative=1e-6)
        recordings = Recordings.open(Path(folder) / "case.h5")
    run, signals = simulate(case, relative=1e-6), recordings.signals
    assert signals is not None
    good = np.setdiff1d(np.arange(len(recordings)), [bad.run for bad in bad_runs_of(case, run.conditions)])
    noise = begin(Scene.of(bench, recordings, NamingSettings()).take(good), lambda *_: None).noise
    exact = Recordings(recordings.conditions, run.lock_time, Signals(signals.time, **run.readings),
                       further=recordings.further)
    # Residuals do not show a noise that signals do not have.
    return replace(Scene.of(bench, exact, NamingSettings()), noise=noise, noise_is_known=True).take(good)


def in_limits(nats: float) -> float:
    """A strength in units of that at which the expected gain is that of five standard errors."""
    return float(np.sqrt(max(0.0, nats) / FIVE_ERRORS))
