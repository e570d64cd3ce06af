"""Full contact is where the plates touch, also in an engagement in which they part and meet again."""

from dataclasses import replace

import numpy as np

from slipstick.clutch.model import Model
from slipstick.naming.contact import WAIT, ContactBlock
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.scene import Scene
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

COUNT = 6


def parted(scene: Scene) -> np.ndarray:
    """The pressure (n, k) in bar with a gap after the plates have met, in all engagements but the first."""
    pressure, step = scene.smooth["pressure"].copy(), scene.step
    met = np.argmax(ClutchBlock(scene, pressure).contact(np.zeros((COUNT, 7))).full > 0, axis=1)
    for i in range(1, COUNT):
        first = met[i] + round(0.06 / step)
        pressure[i, first:first + round(0.2 / step)] = 0.0
    return pressure


def test_samples_near_a_parting_do_not_count_and_those_after_the_next_contact_do() -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT)
    # Late enough for a gap and another contact before lock-up.
    scene = replace(scene, recordings=replace(scene.recordings, measured_time=np.full(COUNT, scene.time[-2])))
    pressure, nothing = parted(scene), np.zeros((COUNT, 7))
    clutch = ClutchBlock(scene, pressure)
    position = clutch._closed(nothing, (), clutch.end)[1]
    counted = ContactBlock(scene, pressure, nothing).counted
    apart = position < scene.value("contact_position")
    wait = round(WAIT / scene.step)
    for i in range(COUNT):
        touching = np.flatnonzero(~apart[i, :clutch.end[i]])
        breaks = np.count_nonzero(np.diff(touching) > 1)
        assert breaks == (i > 0)
        near = np.convolve(apart[i], np.ones(2 * wait + 1), "same") > 0
        near[clutch.end[i] - wait:] = False  # lock-up is no parting
        assert not (counted[i] & near).any()
        assert counted[i, touching[-1] - wait]  # up to lock-up
        if i:
            gap = touching[np.argmax(np.diff(touching) > 1)]
            assert counted[i, :gap].any()
            assert counted[i, gap:].any()
