"""The slip of the closing plates: from the speeds that blocks explain, because noise of the slip weakens the film."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from slipstick.clutch.model import Model
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.scene import Scene
from slipstick.naming.start import Start, begin
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

COUNT, SEED = 24, 2


def as_recorded(model: Model) -> tuple[Scene, np.ndarray]:
    """Engagements whose speeds are known as measured and smoothed, and their true slip behind the gear, (n, k)."""
    scene = scene_of(HEAVY, model, COUNT, SEED)
    speeds = ("input_speed", "output_speed")
    true = scene.smooth["input_speed"] / scene.gear - scene.smooth["output_speed"]
    smooth = {name: scipy.ndimage.gaussian_filter1d(scene.measured(name), 3.0, axis=1) for name in speeds}
    return replace(scene, smooth={**scene.smooth, **smooth}), np.maximum(true, 0)


@pytest.fixture(scope="module")
def plain() -> tuple[Start, np.ndarray]:
    scene, true = as_recorded(Model(HEAVY.physics))
    return begin(scene, lambda _: None), true


def off(clutch: ClutchBlock, true: np.ndarray) -> float:
    """Root mean square error in rad/s of the slip of a block where samples count."""
    return float(np.sqrt(np.mean((clutch.slip - true)[clutch.counted] ** 2)))


def test_explained_speeds_have_less_noise(plain: tuple[Start, np.ndarray]) -> None:
    start, true = plain
    assert start.closing is not None
    clutch = start.closing.with_explained_speeds(start.fits)
    assert off(clutch, true) < 0.6 * off(start.closing.block, true)
    np.testing.assert_array_equal(clutch.in_contact.full, start.closing.block.in_contact.full)


def test_a_speed_that_is_not_explained_remains_the_measured_one() -> None:
    model = Model(HEAVY.physics).with_effect("quadratic_load_drag", {"drag": 0.3})
    scene, _ = as_recorded(model)
    start = begin(scene, lambda _: None)
    assert start.closing is not None
    clutch, before = start.closing.with_explained_speeds(start.fits), start.closing.block
    np.testing.assert_array_equal(clutch.scene.smooth["output_speed"], before.scene.smooth["output_speed"])
    assert not np.array_equal(clutch.scene.smooth["input_speed"], before.scene.smooth["input_speed"])

