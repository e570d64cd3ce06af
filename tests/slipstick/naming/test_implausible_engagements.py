"""Engagements with errors of the recording are set aside before anything is asked, and no others."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming import study
from slipstick.naming.scene import Scene
from slipstick.naming.set_aside import foreign, implausible, outlying
from slipstick.naming.settings import NamingSettings
from slipstick.recordings import Signals
from slipstick.recordings.signals import SIGNAL_UNITS
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

BAD, FEW = 11, 16


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


def with_swapped(scene: Scene, rows: list[int]) -> Scene:
    """The scene with pressure and output speed swapped in these engagements."""
    values = {name: scene.measured(name).copy() for name in SIGNAL_UNITS}
    values["pressure"][rows], values["output_speed"][rows] = values["output_speed"][rows], values["pressure"][rows]
    return Scene.of(HEAVY, replace(scene.recordings, signals=Signals(scene.time, *values.values())), scene.settings)


@pytest.mark.parametrize("rows", [[4], [1, 5, 6, 12, 20, 21]])
def test_swapped_channels_are_set_aside_however_many(scene: Scene, rows: list[int]) -> None:
    assert np.flatnonzero(foreign(with_swapped(scene, rows))).tolist() == rows


def test_none_is_set_aside_if_most_do_not_belong_to_the_bench(scene: Scene) -> None:
    assert not foreign(with_swapped(scene, list(range(20)))).any()


def test_no_more_than_the_limit_is_set_aside(scene: Scene) -> None:
    one, few = with_bad(scene, "input_speed", "flipped"), replace(scene.settings, most_outlying=0.02)
    assert implausible(one).sum() == 1
    assert not implausible(replace(one, settings=few)).any()


def test_good_engagements_are_kept(scene: Scene) -> None:
    assert not implausible(scene).any()
    assert not foreign(scene).any()


@pytest.mark.slow
def test_an_engagement_that_only_the_clutch_does_not_explain_is_set_aside(
        monkeypatch: pytest.MonkeyPatch) -> None:
    few, settings = scene_of(HEAVY, Model(HEAVY.physics), FEW, seed=1), NamingSettings(fewest=FEW)
    judged = list[int]()

    def outlying_in_clutch(chi_squares: Sequence[np.ndarray], settings: NamingSettings) -> np.ndarray:
        if len(chi_squares) > 1:
            return outlying(chi_squares, settings)
        judged.append(len(chi_squares[0]))
        return np.array([BAD])

    monkeypatch.setattr(study, "outlying", outlying_in_clutch)
    assert study.name(HEAVY, few.recordings, settings).set_aside == (BAD,)
    assert judged == [FEW, *[FEW - 1] * 5]  # at last all blocks but full contact, for what is left


def test_an_engagement_that_is_worse_only_beside_what_the_valve_explains_is_set_aside(
        monkeypatch: pytest.MonkeyPatch) -> None:
    recordings = scene_of(HEAVY, Model(HEAVY.physics), 24, seed=1).recordings
    assert recordings.signals is not None
    since, pressure = (recordings.signals.time - 0.2) / 0.1, recordings.signals["pressure"].copy()
    pressure[BAD] += 0.45 * np.sin(np.pi * np.clip(since, 0, 1))  # nine standard deviations of the noise, as it sticks
    signals = replace(recordings.signals, pressure=pressure, input_speed=None, output_speed=None, output_torque=None)
    monkeypatch.setattr(study, "implausible", lambda scene, fits: np.zeros(len(scene), bool))
    named = study.name(HEAVY, replace(recordings, signals=signals))
    assert named.set_aside == (BAD,)
    assert not named.lacking
