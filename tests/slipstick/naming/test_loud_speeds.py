"""Strongly correlated noise of a speed sensor is no law over that speed."""

from dataclasses import replace

import numpy as np
import scipy

from slipstick.clutch.model import Model
from slipstick.naming.evidence import gains, table
from slipstick.naming.fit import BlockFit, fit
from slipstick.naming.input import InputBlock
from slipstick.naming.scene import Scene
from slipstick.naming.start import _first
from tests.benches import COMPACT
from tests.slipstick.naming.engagements import scene_of

NOISE, MEMORY = 0.03, 0.9
LAW = ("input torque", "input speed")


def test_correlated_noise_of_a_speed_is_no_law_over_it() -> None:
    scene = _loud(scene_of(COMPACT, Model(COMPACT.physics), 48, seed=3), "input_speed")
    settings = scene.settings
    assert _gain(fit(InputBlock(_first(InputBlock, scene)[0]))) < 0.5 * settings.nats
    # The smoothed measured speed shares noise with the residual.
    assert _gain(fit(InputBlock(scene))) > settings.nats


def _gain(fitted: BlockFit) -> float:
    """What the law gains in nats."""
    return float(gains([table(fitted, [LAW])], [], [LAW])[0].nats.sum())


def _loud(scene: Scene, name: str) -> Scene:
    """With autoregressive noise of 3 % of the range in a signal, which is smoothed as that of recordings."""
    true, random = scene.smooth[name], np.random.default_rng(8)
    std = NOISE * np.ptp(true)
    white = random.standard_normal(true.shape) * std * np.sqrt(1 - MEMORY**2)
    white[:, 0] /= np.sqrt(1 - MEMORY**2)
    measured = true + scipy.signal.lfilter([1.0], [1.0, -MEMORY], white, axis=1)
    signals = replace(scene.signals, **{name: measured})
    smooth = scipy.ndimage.gaussian_filter1d(measured, scene.settings.smoothing, axis=1)
    return replace(scene, recordings=replace(scene.recordings, signals=signals),
                   smooth={**scene.smooth, name: smooth}, noise={**scene.noise, name: (std, MEMORY)})
