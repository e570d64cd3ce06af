"""Engagements with errors of the recording are set aside before anything is asked, and no others."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming.scene import Scene
from slipstick.naming.set_aside import implausible
from slipstick.recordings import Signals
from slipstick.recordings.signals import SIGNAL_UNITS
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

BAD = 11


@pytest.fixture(scope="module")
def scene() -> Scene:
    return scene_of(HEAVY, Model(HEAVY.physics), 30, seed=1)


def with_bad(scene: Scene, signal: str, kind: str) -> Scene:
    """The scene with the signal of one engagement flipped, or frozen from a fifth of the recording on."""
    values = {name: scene.measured(name).copy() for name in SIGNAL_UNITS}
    row, since = values[signal][BAD], len(scene.time) // 5
    values[signal][BAD] = -row if kind == "flipped" else np.where(np.arange(len(row)) < since, row, row[since])
    return Scene.of(HEAVY, replace(scene.recordings, signals=Signals(scene.time, *values.values())),
                    scene.settings)


@pytest.mark.parametrize("kind", ["frozen", "flipped"])
@pytest.mark.parametrize("signal", ["input_speed", "output_speed"])
def test_a_speed_sensor_that_fails_in_one_engagement_sets_this_one_aside(scene: Scene, signal: str, kind: str) -> None:
    found = implausible(with_bad(scene, signal, kind))
    assert np.flatnonzero(found).tolist() == [BAD]


def test_good_engagements_are_kept(scene: Scene) -> None:
    assert not implausible(scene).any()
