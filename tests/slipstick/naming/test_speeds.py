"""Noise of the speeds and of the torque that drives them, and drifting conditions, are no laws."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from slipstick.clutch.model import Model
from slipstick.naming.evidence import gains, table
from slipstick.naming.fit import BlockFit, fit
from slipstick.naming.input import InputBlock
from slipstick.naming.load import LoadBlock
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.scene import Pair, Scene
from slipstick.naming.start import Start, _first, begin
from tests.benches import COMPACT, HEAVY
from tests.slipstick.naming.engagements import scene_of

COUNT, SEED = 16, 2


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


def test_explained_speeds_do_not_depend_on_what_was_predicted_last(plain: tuple[Start, np.ndarray]) -> None:
    start, _ = plain
    assert start.closing is not None
    before = start.closing.with_explained_speeds(start.fits).scene.smooth
    for name in ("load", "input"):
        start.fits[name].block.at(start.fits[name].shared).base(start.fits[name].points + 0.1)
    after = start.closing.with_explained_speeds(start.fits).scene.smooth
    for name in ("output_speed", "input_speed"):
        np.testing.assert_array_equal(after[name], before[name])


def test_a_speed_that_is_not_explained_remains_the_measured_one() -> None:
    model = Model(HEAVY.physics).with_effect("quadratic_load_drag", {"drag": 0.3})
    scene, _ = as_recorded(model)
    start = begin(scene, lambda _: None)
    assert start.closing is not None
    clutch, before = start.closing.with_explained_speeds(start.fits), start.closing.block
    np.testing.assert_array_equal(clutch.scene.smooth["output_speed"], before.scene.smooth["output_speed"])
    assert not np.array_equal(clutch.scene.smooth["input_speed"], before.scene.smooth["input_speed"])


# Strongly correlated noise of a speed sensor is no law over that speed, nor that of the torque one of the converter.


NOISE, MEMORY = 0.03, 0.9
LAW = ("input torque", "input speed")


@pytest.mark.slow
def test_correlated_noise_of_a_speed_is_no_law_over_it() -> None:
    scene = _loud(scene_of(COMPACT, Model(COMPACT.physics), 48, seed=3), "input_speed")
    settings = scene.settings
    assert _gain(fit(InputBlock(_first(InputBlock, scene)[0]))) < 0.5 * settings.nats
    # The smoothed measured speed shares noise with the residual.
    assert _gain(fit(InputBlock(scene))) > settings.nats


LAG = ("converter torque", "lag")


@pytest.mark.slow
def test_correlated_noise_of_the_torque_is_no_law_of_what_it_drives() -> None:
    scene = _loud(scene_of(COMPACT, Model(COMPACT.physics), 24, seed=3), "output_torque")
    start = begin(scene, lambda _: None)
    assert _gain(start.fits["input"], LAG) < 0.5 * scene.settings.nats
    # An average over a few samples contains the noise that the residual contains.
    scene = start.fits["input"].block.scene
    averaged = scipy.ndimage.gaussian_filter1d(scene.measured("output_torque"), 4.0, axis=1)
    driven = scene.explained("output_torque", scene.model_torque(averaged))
    assert _gain(fit(InputBlock(driven)), LAG) > scene.settings.nats


def _gain(fitted: BlockFit, law: Pair = LAW) -> float:
    """What a law gains in nats."""
    return float(gains([table(fitted, [law])], [], [law])[0].nats.sum())


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


# Brake torque and motor speed that drift over the test, within the errors of stated conditions, are no law.


DRIFT = 0.02


@pytest.fixture(scope="module")
def scene() -> Scene:
    return scene_of(HEAVY, Model(HEAVY.physics), 30, seed=5)


@pytest.mark.parametrize(("kind", "name"), [(LoadBlock, "brake_torque"), (InputBlock, "motor_speed")])
def test_a_drift_of_a_condition_is_found_as_an_error_of_it(scene: Scene, kind: type[LoadBlock | InputBlock],
                                                           name: str) -> None:
    conditions, drift = scene.recordings.conditions, DRIFT * (scene.run / scene.run.max() - 0.5)
    # What is stated is not what was: the true values are larger by the drift.
    stated = replace(conditions, **{name: getattr(conditions, name) / (1 + drift)})
    block = kind(replace(scene, recordings=replace(scene.recordings, conditions=stated), order=scene.run))
    errors = block.level_errors(fit(block).shared)[name]
    steady = kind(scene)
    without = steady.level_errors(fit(steady).shared)[name]
    size = getattr(conditions, name) / getattr(conditions, name).max()  # a share of a small torque is hardly known
    assert np.abs(size * (errors - without - drift)).max() < 0.1 * DRIFT
    assert np.abs(size * (without - drift)).max() > 0.4 * DRIFT
