"""The settings of naming and its record: what is refused, that each constant acts, and what is stored."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipstick.bench.converter import Converter
from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.naming.fit import fit
from slipstick.naming.forward import forward
from slipstick.naming.record import from_json, to_json
from slipstick.naming.scene import Scene
from slipstick.naming.selection import Finding, Rival
from slipstick.naming.settings import NamingSettings, digest_of
from slipstick.naming.study import Naming, scene_of
from tests.benches import HEAVY
from tests.slipstick.naming import engagements
from tests.slipstick.naming.engagements import block_of

SETTINGS = NamingSettings()


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Twelve engagements of the heavy bench, with noise."""
    return engagements.scene_of(HEAVY, Model(HEAVY.physics), 12, seed=1)


@pytest.mark.parametrize(("wrong", "remedy"), [
    ({"errors": float("nan")}, "Give a number of 0 or more"),
    ({"apart": "2.5"}, "Give a number of 0 or more"),
    ({"most_outlying": 0.5}, "Give less than half of the engagements"),
    ({"further": True}, "Give a number of 0 or more"),
    ({"most": 2.5}, "Give a whole number of 0 or more"),
    ({"knots": 1}, "Give a whole number from 2 to 100"),
    ({"finer_knots": 16.5}, "Give a whole number from 2 to 100"),
    ({"smoothing": 0.0}, "Give a number from 0.1 to 30"),
    ({"fewest": 11}, "Give a whole number of 12 or more")])
def test_settings_that_cannot_decide_are_refused(wrong: dict[str, Any], remedy: str) -> None:
    with pytest.raises(InvalidValue) as refused:
        NamingSettings(**wrong)
    name, value = next(iter(wrong.items()))
    assert (refused.value.cause, refused.value.remedy) == (f"{name} is {value!r}", remedy)


def test_every_setting_and_the_method_are_in_the_digest() -> None:
    assert NamingSettings(apart=3.0).digest != SETTINGS.digest
    assert len({digest_of(SETTINGS), digest_of(SETTINGS, "blocks"), digest_of(SETTINGS, "blocks", "naming")}) == 3


def test_the_numbers_of_knots_are_those_of_the_laws(scene: Scene) -> None:
    scene = replace(scene, settings=NamingSettings(knots=3, fine_knots=4))
    load, clutch = block_of("load", scene), block_of("clutch", scene)
    wanted = {("load torque", "time"): (load, 4), ("load torque", "run order"): (load, 2),
              ("friction coefficient", "heat"): (clutch, 4), ("piston rate", "pressure"): (clutch, 3),
              ("output torque sensor", "pressure"): (clutch, 3), ("clearance", "run order"): (clutch, 2)}
    found = {pair: block.law(pair).x for pair, (block, _) in wanted.items()}
    assert {pair: x is not None and len(x) for pair, x in found.items()} == {
        pair: count for pair, (_, count) in wanted.items()}


@pytest.mark.parametrize(("drag", "knots", "finer"), [(0.0, 9, 0), (150.0, 6, 2)])
def test_a_block_that_is_not_explained_has_the_finer_laws(drag: float, knots: int, finer: int) -> None:
    law = MeasuredLaw("load torque", "output speed", (0.0, 10.0, 20.0, 30.0), (0.0, drag, -drag, 0.0), relative=False)
    plain = fit(block_of("load", engagements.scene_of(HEAVY, Model(HEAVY.physics).with_law(law), 12, seed=1)))
    block = forward({"load": plain}, NamingSettings(finer_knots=6, nats=1e9))[0]["load"].block
    assert block.fine == knots
    assert block.finer.get(("output speed sensor", "gain"), 0) == finer
    if finer:  # as many points as the knots of other laws, or more
        points = np.zeros((12, len(block.random)))
        assert block.basis(("output speed sensor", "gain"), points, (), block.base(points)).shape[1] >= knots


def test_smoothing_is_in_samples(scene: Scene) -> None:
    settings, recordings, k = NamingSettings(smoothing=5.0), scene.recordings, len(scene.time)
    impulse = scene.measured("pressure") + (np.arange(k) == 200)
    changed = replace(recordings, signals=replace(scene.signals, pressure=impulse))
    both = [Scene.of(HEAVY, one, settings).smooth["pressure"] for one in (changed, recordings)]
    kernel = both[0] - both[1]
    np.testing.assert_allclose(kernel.sum(axis=1), 1)
    np.testing.assert_allclose(np.sqrt(kernel @ (np.arange(k) - 200.0) ** 2), 5, rtol=0.01)


@pytest.mark.parametrize(("change", "message"), [
    (lambda time: 1e-6 * time, "The signals are from 0 to 1.698e-06 s, and the shifting times from"),
    (lambda time: 1e3 * time, "The signals are from 0 to 1698 s, and the shifting times from"),
    (lambda time: time - 5, "Give the times of the signals in seconds from the shift command"),
    (lambda time: time + 1e6, "Give the times of the signals in seconds from the shift command"),
    (lambda time: time + 4e-4 * (np.arange(len(time)) % 2), "not equidistant: one is 0.4 ms from where")])
def test_a_clock_that_is_not_that_of_the_engagements_is_refused(
        scene: Scene, change: Callable[[np.ndarray], np.ndarray], message: str) -> None:
    signals = replace(scene.signals, time=change(scene.signals.time))
    with pytest.raises(InvalidValue) as error:
        scene_of(HEAVY, replace(scene.recordings, signals=signals), NamingSettings(fewest=12))
    assert message in str(error.value)


def test_engagements_of_few_samples_and_copies_of_engagements_are_refused(scene: Scene) -> None:
    settings, signals = NamingSettings(fewest=12), scene.signals
    sparse = replace(signals, time=signals.time[::50], **{name: signals[name][:, ::50] for name in signals.names})
    with pytest.raises(InvalidValue, match=r"samples before lock-up, 100 ms apart\. Record at least 30"):
        scene_of(HEAVY, replace(scene.recordings, signals=sparse), settings)
    with pytest.raises(InvalidValue, match="The engagements 3 and 11, numbered from 0, have the same signals"):
        scene_of(HEAVY, scene.recordings.take(np.array([*range(11), 3])), settings)


def test_fewer_engagements_than_the_fewest_are_refused(scene: Scene) -> None:
    with pytest.raises(InvalidValue, match=r"12 engagements are too few to tell laws apart\. Record at least 24"):
        scene_of(HEAVY, scene.recordings, SETTINGS)
    assert len(scene_of(HEAVY, scene.recordings, NamingSettings(fewest=12))) == 12


# A stored naming is the same naming again.


def test_a_naming_is_stored_with_all_that_its_findings_state() -> None:
    rival = Rival(("load torque", "time"), 20.0, 1.5)
    gain, expected = np.array([3.0, -1.0, 8.0, 5.0] * 8), np.array([2.0, 0.5, 3.0, 2.5] * 8)
    one = Finding(("load", "lock"), ("output speed sensor", "lag"), gain, (rival,), rival, expected, 46.8)
    bare = Finding(("contact",), ("friction coefficient", "slip"), np.full(32, 4.0), rare=True)
    converter = Converter((0.0, 0.5, 1.0), (2.0, 1.5, 1.0), (10.0, 12.0, 20.0))
    found = Naming((one, bare), (3,), ("input",), {"load": (4, 17)}, {"load": 1.1}, {},
                   {"load_inertia": np.array([0.1, 0.2])},
                   {"pressure": 0.001}, converter, {"input_inertia": (0.35, 0.01)}, {"pressure": (0.1, 0.3)}, 4.5)
    again = from_json(json.loads(json.dumps(to_json(found))))
    assert json.dumps(to_json(again)) == json.dumps(to_json(found))
    for before, after in zip(found.findings, again.findings, strict=True):
        assert (after.pair, after.blocks) == (before.pair, before.blocks)
        assert after.rare == before.rare
        assert (after.errors, after.lead) == (before.errors, before.lead)
        assert (after.rivals == ()) == (before.rivals == ())
    assert again.findings[0].errors == 46.8  # more than the gains have
