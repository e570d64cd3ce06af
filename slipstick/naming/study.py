"""Naming: what recordings ask for beside the model of a bench, block by block.

Laws are added to valve, load, input, lock and full contact, then to the closing piston with all that was found.
"""

import time
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from slipstick.bench import Bench
from slipstick.bench.converter import Converter
from slipstick.blocks.sensor_noise import Noise, power
from slipstick.errors import InvalidValue
from slipstick.naming.asked import Ask, Asked
from slipstick.naming.block import Pair
from slipstick.naming.closing import closing
from slipstick.naming.contact import OnsetBlock
from slipstick.naming.curved import CurvedFit
from slipstick.naming.fit import BlockFit
from slipstick.naming.forward import forward
from slipstick.naming.measured import LawPoints, measured
from slipstick.naming.parameters import clocks_of, converter_of, parameters_of
from slipstick.naming.restarts import evidence_of, settled
from slipstick.naming.scene import Scene
from slipstick.naming.search import search
from slipstick.naming.selection import Finding, is_unexplained
from slipstick.naming.set_aside import bare, foreign, implausible, outlying
from slipstick.naming.settings import NamingSettings
from slipstick.naming.start import Start, begin, noise_left
from slipstick.naming.torque_lag import gained_elsewhere
from slipstick.recordings import Recordings
from slipstick.recordings.needed import open_blocks
from slipstick.threads import in_one_blas_thread, mapped

_SAME = 0.2
"""Difference of the logarithm of power up to which a noise is the same: estimates are as good as that."""


@dataclass(frozen=True, eq=False)
class Naming:
    """What recordings ask for: `findings` block by block, and the engagements `set_aside`, numbered from 0.

    In the blocks `unexplained` something is missing that no pair explains. `chi_square` is the reduced chi-square of
    every block with its findings, 1 where nothing is left but noise. `measured` has the law of each pair as values with
    units. `parameters` (n,) of the engagements that are not set aside are relative to nominal, `clocks` are the delays
    of the signals' clocks in s, and `converter` is that of the bench with the errors of its curve. `noise` has standard
    deviation and autocorrelation of the noise of each signal. `seconds` is the time that it took.
    """

    findings: tuple[Finding, ...]
    set_aside: tuple[int, ...]
    unexplained: tuple[str, ...]
    chi_square: dict[str, float]
    measured: dict[Pair, LawPoints]
    parameters: dict[str, np.ndarray]
    clocks: dict[str, float]
    converter: Converter
    noise: dict[str, Noise]
    seconds: float


@in_one_blas_thread
def name(bench: Bench, recordings: Recordings, settings: NamingSettings | None = None,
         ask: Ask = lambda _: None) -> Naming:
    """Find what `recordings` of a `bench` ask for; raises `InvalidValue` as `scene_of` does."""
    began, settings = time.perf_counter(), settings or NamingSettings()
    ask(Asked("engagements"))
    whole = scene_of(bench, recordings, settings)
    plain = bare(whole)
    believed = np.flatnonzero(~foreign(whole, plain))
    kept = believed[~implausible(whole.take(believed), plain if len(believed) == len(whole) else ())]
    start = begin(whole.take(kept), ask)
    fits, findings = _with_laws(start, settings, ask)
    # What laws explain is no error of a recording, and was no noise.
    most = int(settings.most_outlying * len(believed)) - (len(believed) - len(kept))
    bad = outlying([one.chi2 for one in fits.values()] + start.chi_squares[len(fits):], settings)[:most]
    noise = noise_left(start, fits)
    if len(bad) or _differ(noise, start.noise):
        kept = np.delete(kept, bad)
        start = _again(start, whole.take(kept), bad, noise, ask)
        fits, findings = _with_laws(start, settings, ask)
    everything, named = _with_piston(start, fits, findings, settings, ask)
    odd = outlying([everything["clutch"].chi2] if "clutch" in everything else [], settings)
    if 0 < len(odd) <= most - len(bad):
        kept = np.delete(kept, odd)
        start = _again(start, whole.take(kept), odd, start.noise, ask)
        fits, findings = _with_laws(start, settings, ask)
        everything, named = _with_piston(start, fits, findings, settings, ask)
    return Naming((*start.findings, *named), tuple(np.setdiff1d(np.arange(len(whole)), kept).tolist()),
                  _unexplained(start, everything, settings),
                  {key: float(one.chi2.mean()) for key, one in everything.items()},
                  measured(everything), parameters_of(everything), clocks_of(everything),
                  converter_of(everything, bench.physics.curves), start.noise, time.perf_counter() - began)


def _with_laws(start: Start, settings: NamingSettings, ask: Ask) -> tuple[dict[str, BlockFit], list[Finding]]:
    """The blocks behind the valve with their laws: an error of the pressure would look like laws of full contact."""
    return forward(start.fits, settings, ask, closed=("contact",) if _lacks_pressure(start, settings) else ())


def _with_piston(start: Start, fits: Mapping[str, BlockFit], findings: list[Finding], settings: NamingSettings,
                 ask: Ask) -> tuple[dict[str, BlockFit], list[Finding]]:
    """All blocks with their laws, and the findings behind the valve, where the piston is asked as well."""
    everything = dict(fits) if start.valve is None else {"valve": start.valve[1], **fits}
    if start.closing is None:
        return everything, findings
    clutch, findings = _closed(start, fits, findings, settings, ask)
    return {**everything, "clutch": clutch}, findings


def _again(start: Start, scene: Scene, bad: np.ndarray, noise: Mapping[str, Noise], ask: Ask) -> Start:
    """A start in a `scene` without the engagements `bad` of an earlier one, whose onset is tried as well."""
    known = None
    if start.closing is not None:
        known = np.delete(start.closing.onset.points, bad, axis=0), start.closing.onset.shared
    return begin(replace(scene, noise=dict(noise), noise_is_known=True), ask, known)


def _unexplained(start: Start, everything: Mapping[str, BlockFit], settings: NamingSettings) -> tuple[str, ...]:
    """The blocks that `everything` does not explain: the clutch holds full contact, with a better piston."""
    before = {key: one.chi2 for key, one in start.fits.items()}
    if start.valve is not None:
        before["valve"] = start.valve[0].chi2
    if start.closing is not None:
        before["clutch"] = before["contact"]
    return tuple(key for key, one in everything.items()
                 if key != "contact" and is_unexplained(one.chi2, before[key], settings))


def _lacks_pressure(start: Start, settings: NamingSettings) -> bool:
    """Whether the valve is not explained with its laws."""
    if start.valve is None:
        return False
    bare, found = start.valve
    return is_unexplained(found.chi2, bare.chi2, settings)


def _differ(noise: Mapping[str, Noise], other: Mapping[str, Noise]) -> bool:
    """Whether the power of a noise differs from the other one by so much that laws may be other ones as well."""
    return any(abs(np.log(power(noise[name]) / power(other[name]))) > _SAME for name in noise)


def scene_of(bench: Bench, recordings: Recordings, settings: NamingSettings) -> Scene:
    """The scene of recordings that can be studied.

    Raises `InvalidValue` without the signals of any block, with too few engagements, and for a signal without noise.
    """
    if recordings.signals is None:
        raise InvalidValue("These recordings have no signals, and blocks are driven by measured signals",
                           "Record pressure, speeds and torque as well. A fit of the shifting times alone shows in "
                           "which groups of conditions the model is off")
    if not open_blocks(recordings.signals.names):
        raise InvalidValue(f"These recordings have no signal but the {recordings.signals.names[0].replace('_', ' ')}, "
                           "which is not both ends of a block", "Record the pressure, or the torque and a speed")
    if len(recordings) < settings.fewest:
        raise InvalidValue(f"{len(recordings)} engagements are too few to tell laws apart",
                           f"Record at least {settings.fewest} engagements under different conditions")
    return Scene.of(bench, recordings, settings)


def _closed(start: Start, fits: Mapping[str, BlockFit], findings: list[Finding], settings: NamingSettings,
            ask: Ask) -> tuple[CurvedFit, list[Finding]]:
    """The closing piston with the laws of full contact, and all `findings` with what it asks for itself."""
    assert start.closing is not None
    assert start.valve is not None
    ask(Asked("clutch", ("clutch",)))
    contact = fits["contact"]
    block = start.closing.with_explained_speeds(fits)
    block.fine, block.finer = contact.block.fine, contact.block.finer
    points, clock = start.closing.onset.points.copy(), contact.shared[:1]
    points[:, 0] = contact.points[:, 0]
    starts = [points]
    if contact.laws:
        window = OnsetBlock(block.scene, block.pressure, block.late, laws=contact.held, finer=block.finer)
        window.fine, window.in_contact = block.fine, block.in_contact
        found = search(window, clock, contact.held)
        found[:, 0] = contact.points[:, 0]
        starts.append(found)
    ended = mapped(lambda start: settled(copy(block), start, clock, contact.laws, contact.coefficients), starts)
    clutch = replace(max(ended, key=evidence_of), block=block)
    if contact.laws:
        alone = {one.pair for one in findings if one.blocks == ("contact",)}
        if alone and is_unexplained(clutch.chi2, clutch.chi2, settings):
            others = tuple(law for law in contact.laws if law not in alone)
            without = settled(block, points, clock, others, contact.coefficients)
            if evidence_of(without) > evidence_of(clutch):  # the closing plates contradict what full contact suggests
                clutch, findings = without, [one for one in findings if one.pair not in alone]
    if _lacks_pressure(start, settings):  # the piston integrates the error of the pressure
        return clutch, findings
    in_contact = [one for one in findings if "contact" in one.blocks]
    clutch, closed = closing(block, clutch, settings, ask, in_contact, lambda its: gained_elsewhere(its, fits))
    return clutch, [*(one for one in findings if one not in in_contact), *closed]
