"""Naming: what recordings ask for beside the model of a bench, block by block.

Each block is driven by what was measured at its input, as far as the blocks before explain it: the valve first, then
the closing piston for when the plates meet, load and input, friction in full contact, and the piston with all that was
found.
"""

import time
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from slipstick.bench import Bench
from slipstick.bench.converter import Converter
from slipstick.errors import InvalidValue
from slipstick.naming.block import Pair
from slipstick.naming.closing import closing, evidence_of, settled
from slipstick.naming.contact import LONG_WAIT, WAIT, ContactBlock, OnsetBlock
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.fit import BlockFit, fit
from slipstick.naming.load import LoadBlock
from slipstick.naming.lock import LockBlock
from slipstick.naming.measured import LawPoints, measured
from slipstick.naming.parameters import clocks_of, converter_of, parameters_of
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.scene import Scene
from slipstick.naming.search import retimed, search
from slipstick.naming.selection import Finding, Log, forward, is_unexplained
from slipstick.naming.settings import NamingSettings
from slipstick.naming.shaft import InputBlock
from slipstick.naming.valve import ValveBlock
from slipstick.recordings import Recordings

FEWEST = 24
"""Engagements without which six folds hold too few for a standard error over engagements."""
_LEAST_SPREAD = 0.15
"""Least standard deviation of the logarithm of chi-square of good engagements: that of some 100 independent samples."""
_BELIEVED = 3.0
"""Multiples of the widest scatter beyond which a parameter of the valve is an error of the recording."""
_AVERAGED = 4.0  # samples, of a torque that only serves the columns of other blocks


@dataclass(frozen=True, eq=False)
class Naming:
    """What recordings ask for: `findings` block by block, and the engagements `set_aside`, numbered from 0.

    In the blocks `unexplained` something is missing that no pair explains. `chi_square` is the reduced chi-square of
    every block with its findings, 1 where nothing is left but noise. `measured` has the law of each pair as values with
    units. `parameters` (n,) of the engagements that are not set aside are relative to nominal, `clocks` are the delays
    of the signals' clocks in s, and `converter` is that of the bench with the errors of its curve. `seconds` is the
    time that it took.
    """

    findings: tuple[Finding, ...]
    set_aside: tuple[int, ...]
    unexplained: tuple[str, ...]
    chi_square: dict[str, float]
    measured: dict[Pair, LawPoints]
    parameters: dict[str, np.ndarray]
    clocks: dict[str, float]
    converter: Converter
    seconds: float


@dataclass(frozen=True, eq=False)
class Start:
    """The fits of the blocks before anything but the valve's laws is added, and what the valve asks for.

    `bare` (n,) is the chi-square of the valve without its laws.
    """

    valve: BlockFit
    fits: dict[str, BlockFit]
    bare: np.ndarray
    onset: CurvedFit
    clutch: ClutchBlock
    findings: list[Finding]


def name(bench: Bench, recordings: Recordings, settings: NamingSettings | None = None,
         log: Log = lambda *_: None) -> Naming:
    """Find what `recordings` of a `bench` ask for; raises `InvalidValue` as `scene_of` does."""
    began, settings = time.perf_counter(), settings or NamingSettings()
    whole = scene_of(bench, recordings)
    kept = np.arange(len(whole))
    bad = implausible(whole, settings)
    if bad.mean() <= settings.most_outlying:
        kept = kept[~bad]
    start = begin(whole.take(kept), settings, log)
    bad = np.any([outlying(one.chi2, settings) for one in (*start.fits.values(), start.onset)], axis=0)
    if bad.any() and len(kept) - bad.sum() >= (1 - settings.most_outlying) * len(whole):
        kept = kept[~bad]
        start = begin(whole.take(kept), settings, log)
    fits, findings = forward(start.fits, settings, log)
    clutch, more = _closed(start, fits["contact"], findings, settings, log)
    everything: dict[str, BlockFit] = {"valve": start.valve, **fits, "clutch": clutch}
    before = {"valve": start.bare, **{key: one.chi2 for key, one in start.fits.items()}}
    before["clutch"] = before["contact"]
    return Naming((*start.findings, *findings, *more), tuple(np.setdiff1d(np.arange(len(whole)), kept).tolist()),
                  tuple(key for key, one in everything.items()  # the clutch holds full contact, with a better piston
                        if key != "contact" and is_unexplained(one.chi2, before[key], settings)),
                  {key: float(one.chi2.mean()) for key, one in everything.items()},
                  measured(everything), parameters_of(everything), clocks_of(everything), converter_of(everything),
                  time.perf_counter() - began)


def scene_of(bench: Bench, recordings: Recordings) -> Scene:
    """The scene of recordings that can be studied.

    Raises `InvalidValue` without signals, with too few engagements, and for a signal without noise.
    """
    if recordings.signals is None:
        raise InvalidValue("These recordings have no signals, and blocks are driven by measured signals",
                           "Record pressure, speeds and torque as well")
    if len(recordings) < FEWEST:
        raise InvalidValue(f"{len(recordings)} engagements are too few to tell laws apart",
                           f"Record at least {FEWEST} engagements under different conditions")
    return Scene.of(bench, recordings)


def outlying(chi_square: np.ndarray, settings: NamingSettings) -> np.ndarray:
    """Engagements (n,) far worse than the others: an effect depends on conditions, and acts on more than a few."""
    logs = np.log(np.maximum(chi_square, 1e-3))
    spread = max(_LEAST_SPREAD, 1.4826 * float(np.median(np.abs(logs - np.median(logs)))))
    return np.asarray(logs > np.median(logs) + settings.outlying * spread)


def implausible(scene: Scene, settings: NamingSettings) -> np.ndarray:
    """Engagements (n,) that are outlying in a block without laws, or whose valve has parameters beyond belief."""
    load = LoadBlock(scene)
    lock = LockBlock(scene, load.clean(np.zeros((len(scene), len(load.random)))))
    fits = [fit(block, iterations=2) for block in (ValveBlock(scene), load, InputBlock(scene), lock)]
    # A linear block explains even a reversed sensor: by parameters that no scatter makes plausible.
    own = fits[0].fitted.each - np.median(fits[0].fitted.each, axis=0)  # a single one may pull the mean of all
    reversed_sensor = np.any(np.abs(own) > _BELIEVED * fits[0].block.widest, axis=1)
    return np.asarray(np.any([*(outlying(one.chi2, settings) for one in fits), reversed_sensor], axis=0))


def begin(scene: Scene, settings: NamingSettings, log: Log) -> Start:
    """Fit the blocks one after the other, each with what the ones before explain of its inputs."""
    valve_block = ValveBlock(scene)
    bare = fit(valve_block)
    fits, findings = forward({"valve": bare}, settings, log)
    valve = fits["valve"]
    pressure = valve_block.pressure(valve.points, valve.held)
    scene = scene.explained("pressure", pressure)
    onset, window, clutch = _onset(scene, pressure)
    log("onset", round(float(onset.chi2.mean()), 3))
    clutch.at(onset.shared)  # where the torque is not a measured one, it is late as well
    averaged = gaussian_filter1d(scene.measured("output_torque"), _AVERAGED, axis=1)
    torque = np.where(window, clutch.predicted_beyond(onset.points), averaged)
    scene = scene.explained("output_torque", scene.model_torque(torque))
    load_block = LoadBlock(scene)
    load = fit(load_block)
    scene = scene.explained("output_speed", load_block.true_speed(load.predicted))
    shaft_block = InputBlock(scene)
    shaft = fit(shaft_block)
    scene = scene.explained("input_speed", shaft_block.true_speed(shaft.predicted))
    lock = fit(LockBlock(scene, load_block.clean(load.points)))
    wait = LONG_WAIT if onset.chi2.mean() > settings.strong else WAIT
    contact = fit(ContactBlock(scene, pressure, onset.points, wait=wait))
    return Start(valve, {one.block.name: one for one in (load, shaft, lock, contact)}, bare.chi2, onset, clutch,
                 findings)


def _onset(scene: Scene, pressure: np.ndarray) -> tuple[CurvedFit, np.ndarray, ClutchBlock]:
    """The piston up to full contact, the samples (n, k) that it counts, and the clutch with its time in contact."""
    block = OnsetBlock(scene, pressure)
    clock = np.zeros(len(block.fixed))
    rough = fit_curved(block, points=retimed(block, search(block, clock), clock, ()), iterations=8)
    clutch = ClutchBlock(scene, pressure)
    block = OnsetBlock(scene, pressure, contact=clutch.contact(rough.points, ()))
    onset = settled(block, rough.points, rough.shared)
    clutch.in_contact = clutch.contact(onset.points, ())
    return onset, block.counted, clutch


def _closed(start: Start, contact: BlockFit, findings: list[Finding], settings: NamingSettings,
            log: Log) -> tuple[CurvedFit, list[Finding]]:
    """The closing piston with the laws of full contact, and what it asks for itself."""
    block = start.clutch
    block.fine = contact.block.fine
    points = start.onset.points.copy()
    points[:, 0] = contact.points[:, 0]
    clutch = settled(block, points, contact.shared, contact.laws, contact.coefficients)
    if contact.laws:
        window = OnsetBlock(block.scene, block.pressure, laws=contact.held)
        window.fine, window.in_contact = block.fine, block.in_contact
        found = search(window, contact.shared, contact.held)
        found[:, 0] = contact.points[:, 0]
        again = settled(block, found, contact.shared, contact.laws, contact.coefficients)
        clutch = max(clutch, again, key=evidence_of)
    if start.valve.chi2.mean() > settings.strong:  # the piston integrates the error of the pressure
        return clutch, []
    least = settings.further * max((one.nats for one in findings if "contact" in one.blocks), default=0.0)
    return closing(block, clutch, settings, least, log)
