"""What the valve block does not explain of the pressure is no law of the friction that it drives."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming.contact import ContactBlock
from slipstick.naming.fit import fit
from slipstick.naming.forward import forward
from slipstick.naming.selection import Finding
from slipstick.naming.settings import NamingSettings
from slipstick.naming.start import begin, noise_left
from slipstick.naming.study import Naming, _differ, name
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

COUNT, FEWER, SEED = 36, 12, 3
ERROR = 0.07
FRICTION = "friction coefficient"


def contact_findings(model: Model, error: float, known: bool) -> list[Finding]:
    """What full contact asks for where the pressure is off by waves over itself, and whether their size is known."""
    scene = scene_of(HEAVY, model, COUNT, SEED)
    true = scene.smooth["pressure"]
    pressure = true + error * np.sin(2 * np.pi * true / 2.5)
    scene = replace(scene, pressure_error=(ERROR / np.sqrt(2), 0.99) if known else (0.0, 0.0))
    block = ContactBlock(scene, pressure, np.zeros((COUNT, 7)))
    return forward({"contact": fit(block)}, NamingSettings())[1]


def test_an_error_of_the_pressure_is_hardly_a_law_of_the_friction_where_it_is_known_of() -> None:
    """Hardly: it is known as a function of time, and is one of the pressure."""
    gains = [sum(one.nats for one in contact_findings(Model(HEAVY.physics), ERROR, known)) for known in (False, True)]
    assert gains[1] < 0.1 * gains[0]


@pytest.mark.slow
def test_a_strong_law_of_the_friction_is_found_beside_an_error_of_the_pressure() -> None:
    model = Model(HEAVY.physics).with_effect("stribeck_friction", {"strength": 0.3, "decay_speed": 20.0})
    assert [one.pair for one in contact_findings(model, ERROR, known=True)] == [(FRICTION, "slip")]


def test_the_noise_is_that_which_laws_leave() -> None:
    model = Model(HEAVY.physics).with_effect("stribeck_friction", {"strength": 0.5, "decay_speed": 20.0})
    start = begin(scene_of(HEAVY, model, FEWER, SEED), lambda _: None)
    fits, findings = forward(start.fits, NamingSettings())
    assert [one.pair for one in findings] == [(FRICTION, "slip")]
    after = noise_left(start, fits)
    true = HEAVY.sensors["output_torque"].noise
    assert after["output_torque"][0] == pytest.approx(true, rel=0.1)
    assert abs(after["output_torque"][1]) < 0.15
    assert not _differ(after, after)
    assert _differ({**after, "pressure": (1.2 * after["pressure"][0], after["pressure"][1])}, after)


def test_a_noise_that_is_known_is_not_estimated_again() -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)
    wrong = replace(scene, noise={name: (2 * std, 0.0) for name, (std, _) in scene.noise.items()})
    block = block_of("load", wrong)
    found = fit(block)
    args = "output_speed", block.measured - found.predicted, block.counted, found.noise
    true = scene.noise["output_speed"][0]
    assert wrong.with_noise(*args).noise["output_speed"][0] == pytest.approx(true, rel=0.1)
    assert replace(wrong, noise_is_known=True).with_noise(*args).noise["output_speed"][0] == 2 * true


def named(waves: float) -> Naming:
    """What is named with a friction that depends on the slip, where the pressure sensor adds waves of each engagement.
    """
    model = Model(HEAVY.physics).with_effect("stribeck_friction", {"strength": 0.3, "decay_speed": 20.0})
    recordings = scene_of(HEAVY, model, FEWER, SEED).recordings
    assert recordings.signals is not None
    random, time = np.random.default_rng(SEED), recordings.signals.time
    phase = 2 * np.pi * (random.uniform(2, 6, (FEWER, 1)) * time + random.uniform(size=(FEWER, 1)))
    signals = replace(recordings.signals, pressure=recordings.signals["pressure"] + waves * np.sin(phase))
    return name(HEAVY, replace(recordings, signals=signals), NamingSettings(fewest=FEWER))


@pytest.mark.slow
def test_the_clutch_is_asked_for_nothing_where_the_pressure_is_not_explained() -> None:
    right, spoiled = named(0.0), named(0.3)
    assert (FRICTION, "slip") in [one.pair for one in right.findings]
    assert not right.unexplained
    assert "valve" in spoiled.unexplained
    assert not [one.pair for one in spoiled.findings if {"contact", "clutch"} & set(one.blocks)]
    assert spoiled.chi_square["contact"] > 2
