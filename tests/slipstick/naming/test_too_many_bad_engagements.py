"""Where more engagements are bad than may be set aside, the worst are, and what the findings explain is not bad."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming import study
from slipstick.naming.study import Naming, name
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.signals import SIGNAL_UNITS
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

COUNT, BAD = 24, [3, 8, 15]
MOST = 2
"""A tenth of the engagements, in whole ones."""


@cache
def recordings() -> Recordings:
    """Output speeds that lose a tenth for a while after lock-up, as if belts slipped, in too many engagements."""
    recorded = scene_of(HEAVY, Model(HEAVY.physics), COUNT, seed=1).recordings
    assert recorded.signals is not None
    values = {signal: recorded.signals[signal].copy() for signal in SIGNAL_UNITS}
    time = recorded.signals.time
    for row in BAD:
        since = recorded.measured_time[row] + 0.1
        values["output_speed"][row] *= np.where((time > since) & (time < since + 0.2), 0.9, 1.0)
    return replace(recorded, signals=Signals(time, *values.values()))


@cache
def named() -> Naming:
    """The naming of these recordings."""
    return name(HEAVY, recordings())


@pytest.mark.slow
def test_the_worst_are_set_aside_and_nothing_is_named() -> None:
    found = named()
    assert len(found.set_aside) == MOST
    assert set(found.set_aside) < set(BAD)
    assert found.findings == ()
    left = {row for rows in found.outlying.values() for row in rows}
    assert left | set(found.set_aside) == set(BAD)
    assert "load" in found.lacking


@pytest.mark.slow
def test_the_worst_are_set_aside_without_pressure_as_well() -> None:
    signals = recordings().signals
    assert signals is not None
    found = name(HEAVY, replace(recordings(), signals=replace(signals, pressure=None)))
    assert len(found.set_aside) == MOST
    assert set(found.set_aside) < set(BAD)
    assert (found.findings, list(found.chi_square)) == ((), ["load", "input", "lock"])


@pytest.mark.slow
def test_without_this_none_would_be(monkeypatch: pytest.MonkeyPatch) -> None:
    left = named().chi_square["load"]
    monkeypatch.setattr(study, "outlying", lambda *_: np.zeros(0, int))
    found = name(HEAVY, recordings())
    assert found.set_aside == ()
    assert found.chi_square["load"] > 5 * left


@pytest.mark.slow
def test_engagements_with_more_noise_are_not_far_worse(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where an amplifier was changed during the test: a third of the engagements has 1.8 times the noise."""
    scene, rng = scene_of(HEAVY, Model(HEAVY.physics), COUNT, seed=1), np.random.default_rng(4)
    signals = scene.recordings.signals
    assert signals is not None
    more = {name: signals[name] + 1.5 * scene.noise[name][0] * rng.standard_normal(signals[name].shape)
            * (np.arange(COUNT) % 3 == 0)[:, None] for name in SIGNAL_UNITS}
    louder = replace(scene.recordings, signals=Signals(signals.time, *more.values()))
    judge, judged = study._find_outlying, list[tuple[Any, ...]]()  # the same fits are judged in two ways
    monkeypatch.setattr(study, "_find_outlying", lambda *fits: judged.append(fits) or judge(*fits))
    found = name(HEAVY, louder)
    assert (found.findings, found.outlying, found.lacking) == ((), {}, ())
    monkeypatch.setattr(study, "own_noise", lambda scene: np.ones(len(scene)))
    assert judge(*judged[-1])
