"""Brake torque and motor speed that drift over the test, within the errors of stated conditions, are no law."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming.fit import fit
from slipstick.naming.input import InputBlock
from slipstick.naming.load import LoadBlock
from slipstick.naming.scene import Scene
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

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
