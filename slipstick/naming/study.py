"""Naming: what recordings ask for beside the model of a bench, block by block."""

from dataclasses import dataclass
import time

import numpy as np
from scipy.ndimage import gaussian_filter1d

from slipstick.bench import Bench
from slipstick.naming.contact import ContactBlock, OnsetBlock
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.fit import BlockFit, fit
from slipstick.naming.load import LoadBlock
from slipstick.naming.lock import LockBlock
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.scene import Scene
from slipstick.naming.search import relocated, retimed, search
from slipstick.naming.selection import FURTHER, Finding, forward, piston
from slipstick.naming.shaft import InputBlock
from slipstick.naming.valve import ValveBlock
from slipstick.recordings import Recordings

MOST_BAD = 0.1
OUTLYING = 6.0
LEAST_SPREAD = 0.15


@dataclass(frozen=True, eq=False)
class Naming:
    findings: tuple[Finding, ...]
    set_aside: tuple[int, ...]
    chi_square: dict[str, float]
    seconds: float


def outlying(chi_square: np.ndarray) -> np.ndarray:
    """Engagements (n,) far worse than the others: nothing that depends on conditions explains single ones."""
    logs = np.log(np.maximum(chi_square, 1e-3))
    spread = max(LEAST_SPREAD, 1.4826 * float(np.median(np.abs(logs - np.median(logs)))))
    return logs > np.median(logs) + OUTLYING * spread


@dataclass(frozen=True, eq=False)
class Start:
    """Fits of all blocks without any law beyond the `valve`'s."""

    scene: Scene
    valve: BlockFit
    fits: dict
    onset: CurvedFit
    clutch: ClutchBlock
    findings: list


def plain(scene: Scene) -> np.ndarray:
    """Engagements (n,) that are outlying in a block driven by what was measured."""
    load = LoadBlock(scene)
    blocks = [ValveBlock(scene), load, InputBlock(scene), LockBlock(scene, load.clean(np.zeros((len(scene), 5))))]
    fits = [fit(block, iterations=2) for block in blocks]
    # A linear block explains even a reversed sensor by parameters, which no scatter makes plausible.
    implausible = [np.any(np.abs(fits[0].fitted.each) > 3 * fits[0].block.widest, axis=1)]
    return np.any([*(outlying(one.chi2) for one in fits), *implausible], axis=0)


def begin(scene: Scene, log) -> Start:
    """Fit the blocks one after the other, each with what the one before explains of its inputs."""
    valve_block = ValveBlock(scene)
    fits, findings = forward({"valve": fit(valve_block)}, log=log)
    valve = fits["valve"]
    pressure = valve_block.pressure(valve.points, [(law, valve.coefficients[law]) for law in valve.laws])
    scene = scene.explained("pressure", pressure)
    onset_block = OnsetBlock(scene, pressure)
    onset = fit_curved(onset_block, points=retimed(onset_block, search(onset_block), ()), iterations=8)
    clutch = ClutchBlock(scene, pressure)
    onset_block = OnsetBlock(scene, pressure, contact=clutch.contact(onset.points, ()))
    onset = settled(onset_block, onset.points)
    clutch.in_contact = clutch.contact(onset.points, ())
    log("onset", round(float(onset.chi2.mean()), 3))
    averaged = gaussian_filter1d(scene.measured("output_torque"), 4, axis=1)
    torque = np.where(onset_block.counted, clutch.predicted_beyond(onset.points), averaged)
    scene = scene.explained("output_torque", scene.model_torque(torque))
    load = fit(LoadBlock(scene))
    scene = scene.explained("output_speed", load.block.true_speed(load.predicted))
    shaft = fit(InputBlock(scene))
    scene = scene.explained("input_speed", shaft.block.true_speed(shaft.predicted))
    lock = fit(LockBlock(scene, load.block.clean(load.points)))
    contact = fit(ContactBlock(scene, pressure, onset.points))
    return Start(scene, valve, {one.block.name: one for one in (load, shaft, lock, contact)}, onset, clutch, findings)


def settled(block: ClutchBlock, points: np.ndarray, laws=(), coefficients=None) -> CurvedFit:
    """The best fit of the closing piston from `points`, and from what a search finds for outlying engagements."""
    held = [(law, coefficients[law]) for law in laws]
    best = fit_curved(block, laws, points=retimed(block, points, held), coefficients=coefficients, iterations=8)
    rows = outlying(best.chi2) | (best.chi2 > 1.5)
    if rows.any():
        held = [(law, best.coefficients[law]) for law in laws]
        again = fit_curved(block, laws, points=relocated(block, best.points, held, rows), coefficients=best.coefficients, iterations=8)
        best = max(best, again, key=lambda one: one.evidence.sum())
    return best


def name(bench: Bench, recordings: Recordings, log=lambda *_: None) -> Naming:
    """Find what `recordings` of a `bench` ask for."""
    began = time.perf_counter()
    whole = Scene.of(bench, recordings)
    kept = np.arange(len(whole))
    bad = plain(whole)
    if bad.mean() <= MOST_BAD:
        kept = kept[~bad]
    start = begin(whole.take(kept), log)
    bad = np.any([outlying(one.chi2) for one in (*start.fits.values(), start.onset)], axis=0)
    if bad.any() and len(kept) - bad.sum() >= (1 - MOST_BAD) * len(whole):
        log("set aside", kept[bad])
        kept = kept[~bad]
        start = begin(whole.take(kept), log)
    fits, findings = forward(start.fits, log=log)
    contact = fits["contact"]
    held = [(law, contact.coefficients[law]) for law in contact.laws]
    points = start.onset.points.copy()
    points[:, 0] = contact.points[:, 0]
    block = start.clutch
    block.fine = contact.block.fine
    clutch = settled(block, points, contact.laws, contact.coefficients)
    if contact.laws:
        window = OnsetBlock(block.scene, block.pressure)
        window.fine, window.in_contact = block.fine, block.in_contact
        found = search(window, held)
        found[:, 0] = contact.points[:, 0]
        clutch = max(clutch, settled(block, found, contact.laws, contact.coefficients), key=lambda one: one.evidence.sum())
    most = max((f.nats for f in findings if "contact" in f.block), default=0.0)
    clutch, more = piston(block, clutch, least=FURTHER * most, log=log)
    everything = {"valve": start.valve, **fits, "clutch": clutch}
    aside = np.setdiff1d(np.arange(len(whole)), kept)
    return Naming((*start.findings, *findings, *more), tuple(aside.tolist()),
                  {key: float(one.chi2.mean()) for key, one in everything.items()}, time.perf_counter() - began)
