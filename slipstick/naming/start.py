"""The blocks of a bench fitted one after the other, each with what the blocks before explain of its inputs.

The valve comes first, then the closing piston for when the plates meet, load and input, and friction in full contact.
A block can be asked if the signals that it needs were measured.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy

from slipstick.blocks.sensor_noise import Noise, in_common, noise_of
from slipstick.naming.asked import Ask, Asked
from slipstick.naming.block import Block, changed
from slipstick.naming.contact import LONG_WAIT, WAIT, ContactBlock, OnsetBlock
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.fit import BlockFit, fit
from slipstick.naming.forward import forward, lacks_something
from slipstick.naming.input import InputBlock
from slipstick.naming.load import LoadBlock
from slipstick.naming.lock import LockBlock
from slipstick.naming.parameters import converter_of, parameters_of
from slipstick.naming.piston import ClutchBlock, Late
from slipstick.naming.piston_laws import of_plates
from slipstick.naming.restarts import evidence_of, settled
from slipstick.naming.scene import Scene
from slipstick.naming.search import retimed, search
from slipstick.naming.selection import Finding, is_unexplained
from slipstick.naming.valve import ValveBlock, deviations_along_axes
from slipstick.recordings.signals import open_blocks

_AVERAGED = 4.0  # samples, of a torque that only serves the columns of other blocks


class Onset(NamedTuple):
    """What an earlier start found at the onset of the torque.

    Parameters `points` (n, q) of the piston in each engagement, the `shared` values (p,), and `of_plates` as `Scene`
    has it.
    """

    points: np.ndarray
    shared: np.ndarray
    of_plates: Mapping[str, np.ndarray]

    def without(self, rows: np.ndarray) -> "Onset":
        """That of the engagements but `rows`."""
        left = {name: np.delete(values, rows, axis=0) for name, values in self.of_plates.items()}
        return Onset(np.delete(self.points, rows, axis=0), self.shared, left)


@dataclass(frozen=True, eq=False)
class Closing:
    """The closing piston: the clutch up to lock-up, and its fit up to full contact, without laws."""

    block: ClutchBlock
    onset: CurvedFit
    counted: np.ndarray
    """Samples (n, k) up to full contact."""

    @property
    def known(self) -> Onset:
        """What another start can begin with."""
        return Onset(self.onset.points, self.onset.shared, of_plates(self.block.scene, self.block.in_contact))

    def with_explained_speeds(self, fits: Mapping[str, BlockFit]) -> ClutchBlock:
        """The clutch with the speeds that `fits` explain: what a noisy slip predicts has too weak a film torque.

        A speed that is not explained remains the smoothed measured one.
        """
        scene = self.block.scene
        scene = replace(scene, of_plates=of_plates(scene, self.block.in_contact))  # as the blocks that come after it
        for name in ("load", "input"):
            if name in fits and not is_unexplained(fits[name].chi2, fits[name].chi2, scene.settings):
                scene = _explained(scene, fits[name])
        block = ClutchBlock(scene, self.block.pressure, self.block.late)
        return changed(block, in_contact=self.block.in_contact).knowing(self.onset.points)


@dataclass(frozen=True, eq=False)
class Start:
    """The fits of the blocks whose signals were measured, before anything but the valve's laws is added.

    `valve` has the fits without and with its `findings`, `fits` those of load, input, lock and full contact. `noise`
    has standard deviation and autocorrelation of the noise of each signal.
    """

    valve: tuple[BlockFit, BlockFit] | None
    findings: list[Finding]
    closing: Closing | None
    fits: dict[str, BlockFit]
    noise: dict[str, Noise]

    @property
    def chi_squares(self) -> list[np.ndarray]:
        """Chi-squares (n,) of the engagements in the blocks behind the valve."""
        return [block_fit.chi2 for block_fit in (*self.fits.values(), *([self.closing.onset] if self.closing else []))]


def begin(scene: Scene, ask: Ask, known: Onset | None = None, keep: Callable[[Start], None] = lambda _: None) -> Start:
    """Fit the blocks one after the other, each with what the ones before explain of its inputs.

    What an earlier start found is `known` of the onset: it is another place from which the piston is fitted. `keep` is
    called when the valve is complete, with a start that has nothing else.
    """
    can, valve, findings, closing_piston = open_blocks(tuple(scene.smooth)), None, list[Finding](), None
    scene = scene if known is None else replace(scene, of_plates=known.of_plates)
    if "valve" in can:
        ask(Asked("valve", ("valve",)))
        scene, _ = _first(ValveBlock, scene)
        bare = fit(ValveBlock(scene))
        if known is None and "clutch" in can and lacks_something(bare, scene.settings):  # it may depend on the plates
            bare = replace(bare, block=changed(bare.block, scene=replace(scene, of_plates=_plates(scene))))
        fits, findings = forward({"valve": bare}, scene.settings, ask, "valve")
        valve = bare, fits["valve"]
        keep(Start(valve, findings, None, {}, scene.noise))
        scene, late = _with_pressure(scene, valve[1])
        pressure = scene.smooth["pressure"]
    if "clutch" in can:
        ask(Asked("onset", ("clutch",)))
        rough = _rough(scene, pressure, late, known)
        closing_piston = _onset(scene, pressure, late, rough)
        contact = fit(ContactBlock(scene, pressure, closing_piston.onset.points, late))
        scene = _with_noise(scene, closing_piston.onset, contact)
        closing_piston = _onset(scene, pressure, late, rough)
        scene = replace(scene, of_plates=closing_piston.known.of_plates)
    fits = {}
    if "load" in can or "input" in can:
        torque = _torque(scene, closing_piston)
        scene = scene.explained("output_torque", scene.model_torque(torque))
    if "load" in can:
        ask(Asked("load", ("load",)))
        scene, fits["load"] = _first(LoadBlock, scene)
    if "input" in can:
        ask(Asked("input", ("input",)))
        scene, fits["input"] = _first(InputBlock, scene)
    if fits:  # what the shafts say of their parameters moves the torque from lock-up on
        parameters, converter = parameters_of(fits), converter_of(fits, scene.bench.physics.curves)
        scene = scene.explained("output_torque", scene.model_torque(torque, parameters, converter))
    if "load" in can:
        scene, fits["load"] = _again(LoadBlock, scene)
    if "input" in can:
        scene, fits["input"] = _again(InputBlock, scene)
    if "lock" in can:
        ask(Asked("lock", ("lock",)))
        load = fits["load"].block
        assert isinstance(load, LoadBlock)
        fits["lock"] = fit(LockBlock(scene, load.clean(fits["load"].points)))
    if closing_piston is not None:
        ask(Asked("contact", ("contact",)))
        onset = closing_piston.onset
        wait = LONG_WAIT if onset.chi2.mean() > scene.settings.strong else WAIT
        fits["contact"] = fit(ContactBlock(scene, pressure, onset.points, late, wait))
    return Start(valve, findings, closing_piston, fits, scene.noise)


def _with_pressure(scene: Scene, valve: BlockFit) -> tuple[Scene, Late]:
    """The scene with the pressure that the valve explains, and how far; and what it was some time before."""
    block, means = valve.block, len(valve.block.random)
    assert isinstance(block, ValveBlock)
    # How far the parameters of each engagement are known, and what an error of their means does to these.
    moves = np.concatenate([deviations_along_axes(valve.fitted.spread), valve.fitted.follows @ deviations_along_axes(
        valve.fitted.covariance[:means, :means])], axis=2)
    changes = block.changes(valve.points, valve.held, moves)
    left, profiles = block.measured - valve.predicted, scene.recordings.conditions.current_profile
    # Only where it lacks something: an error that is estimated where there is none costs friction laws power.
    lacks = valve.laws or is_unexplained(valve.chi2, valve.chi2, scene.settings)
    scene = replace(scene.explained("pressure", block.pressure(valve.points, valve.held)),
                    pressure_error=in_common(left, profiles) if lacks else (0.0, 0.0),
                    pressure_modes=changes[:, :means], pressure_means=changes[:, means:])
    return scene, partial(block.pressure, valve.points, valve.held)


def _again(kind: Callable[[Scene], Block], scene: Scene) -> tuple[Scene, BlockFit]:
    """A fit of a block of a scene whose noise is known, and the scene with the speed that it explains."""
    block_fit = fit(kind(scene))
    return _explained(scene, block_fit), block_fit


def _first(kind: Callable[[Scene], Block], scene: Scene) -> tuple[Scene, BlockFit]:
    """A first fit of a block, and the scene with what it says of its signal: the noise that it leaves, and the speed.

    Laws of torques over a speed depend on the one that the first fit explains. The smoothed measured one shares noise
    with the residual, which strongly correlated noise turns into laws.
    """
    block_fit = fit(kind(scene))
    return _explained(_with_noise(scene, block_fit), block_fit), block_fit


def _explained(scene: Scene, block_fit: BlockFit) -> Scene:
    """The scene with the speed that a fit explains; the pressure is explained once the valve has its laws."""
    block = block_fit.block
    if not isinstance(block, LoadBlock | InputBlock):
        return scene
    return scene.explained(block.signal, block.true_speed(block_fit.predicted))


def _with_noise(scene: Scene, *block_fits: BlockFit) -> Scene:
    """The scene with the noise of a signal that blocks leave, each where it counts."""
    return scene.with_noise(block_fits[0].block.signal, *_left(block_fits), block_fits[0].noise)


def _left(block_fits: Sequence[BlockFit]) -> tuple[np.ndarray, np.ndarray]:
    """What blocks of a signal leave and where it counts, in rows of their own.

    Where one block follows another what is left jumps, because each has parameters of its own.
    """
    return (np.concatenate([block_fit.block.measured - block_fit.predicted for block_fit in block_fits]),
            np.concatenate([block_fit.block.counted for block_fit in block_fits]))


def noise_left(start: Start, fits: Mapping[str, BlockFit]) -> dict[str, Noise]:
    """The noise of each signal that blocks leave with the laws of `fits`: that without them contains what they explain.

    That of a signal that no block predicts, such as the torque where there is no pressure, is as it was.
    """
    leave = [[fits[name]] for name in ("load", "input") if name in fits]
    if start.valve is not None:
        leave.append([start.valve[1]])
    if start.closing is not None:
        leave.append([start.closing.onset, fits["contact"]])
    return {**start.noise, **{block_fits[0].block.signal: noise_of(*_left(block_fits), block_fits[0].noise)
                              for block_fits in leave}}


def _rough(scene: Scene, pressure: np.ndarray, late: Late | None, known: Onset | None) -> CurvedFit:
    """The piston until shortly after the torque sets in, from a search, or from what is known if that ends better."""
    block = OnsetBlock(scene, pressure, late)
    clock = np.zeros(len(block.fixed))
    searched = fit_curved(block, points=retimed(block, search(block, clock), clock, ()), iterations=8)
    if known is None:
        return searched
    return max(searched, fit_curved(block, points=known.points, shared=known.shared, iterations=8), key=evidence_of)


def _plates(scene: Scene) -> dict[str, np.ndarray]:
    """What the plates do under the measured pressure, roughly: before the valve block is known to explain it."""
    pressure = scene.smooth["pressure"]
    rough = _rough(scene, pressure, None, None)
    return of_plates(scene, ClutchBlock(scene, pressure).contact(rough.points))


def _onset(scene: Scene, pressure: np.ndarray, late: Late, rough: CurvedFit) -> Closing:
    """The piston up to full contact, where a `rough` fit has it, and the clutch with its time in contact."""
    clutch = ClutchBlock(scene, pressure, late)
    block = OnsetBlock(scene, pressure, late, contact=clutch.contact(rough.points).full).knowing(rough.points)
    onset = settled(block, rough.points, rough.shared)
    return Closing(changed(clutch, in_contact=clutch.contact(onset.points)), onset, block.counted)


def _torque(scene: Scene, closing_piston: Closing | None) -> np.ndarray:
    """Output torque (n, k) in N m up to lock-up, for columns: that of the clutch, or else the averaged measured one.

    The average of a correlated noise is hardly less than this, and columns would contain what the residuals of load and
    input contain. It is only taken where full contact is not explained, or there is no pressure.
    """
    averaged = scipy.ndimage.gaussian_filter1d(scene.measured("output_torque"), _AVERAGED, axis=1)
    if closing_piston is None:
        return np.asarray(averaged)
    onset = closing_piston.onset
    clutch = closing_piston.block.at(onset.shared)  # where the torque is not a measured one, it is late as well
    closing = clutch.predicted_beyond(onset.points)
    contact = fit(ContactBlock(scene, clutch.pressure, onset.points, clutch.late))
    if is_unexplained(contact.chi2, contact.chi2, scene.settings):
        return np.where(closing_piston.counted, closing, averaged)
    in_contact = clutch.predicted_beyond(np.concatenate([contact.points, onset.points[:, 1:]], axis=1))
    return np.where(closing_piston.counted, closing, in_contact)
