"""Laws of full contact while the plates close: the heat on which they depend, and as many knots as they need there."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy

from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.naming.block import Pair
from slipstick.naming.closing import _backward, _finer, _followed, _plainest, _Tried
from slipstick.naming.curved import CurvedFit
from slipstick.naming.fit import fit
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.piston_laws import of_plates
from slipstick.naming.restarts import settled
from slipstick.naming.search import search
from slipstick.naming.selection import Finding, is_unexplained
from slipstick.naming.settings import NamingSettings
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

COUNT, SEED, SETTINGS = 24, 5, NamingSettings()
HEAT, SPEED = ("friction coefficient", "heat"), ("friction coefficient", "motor speed")
AT = np.linspace(0, 6.0, 16)  # kJ
WAVE = MeasuredLaw(*HEAT, tuple(AT), tuple(0.1 * np.sin(AT * 2 * np.pi / 2.4)), relative=True)


@cache
def coarse(*laws: Pair) -> tuple[ClutchBlock, CurvedFit]:
    """The clutch with laws of full contact, that over the heat with few knots, of a friction that depends on the heat.
    """
    scene = scene_of(HEAVY, Model(HEAVY.physics).with_law(WAVE), COUNT, SEED)
    block, contact = block_of("clutch", scene), fit(block_of("contact", scene), laws)
    assert isinstance(block, ClutchBlock)
    found = search(block, np.zeros(1), contact.held)
    return block, settled(block, found, np.zeros(1), contact.laws, contact.coefficients)


def heats(sample_time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (k,) in s, and heat (n, k) in kJ of the plates, also as a smoothed torque gives it."""
    block = block_of("clutch", scene_of(replace(HEAVY, sample_time=sample_time), Model(HEAVY.physics), COUNT))
    assert isinstance(block, ClutchBlock)
    contact, scene = block.in_contact, block.scene
    smooth = scipy.ndimage.gaussian_filter1d(contact.friction, SETTINGS.smoothing, axis=1)
    return scene.time, *(of_plates(scene, one)["heat"] for one in (contact, replace(contact, friction=smooth)))


def test_the_heat_is_that_of_a_fine_sampling_although_the_torque_rises_within_few_samples() -> None:
    time, found, smoothed = heats(0.006)
    fine, exact, _ = heats(0.0002)
    true = np.array([np.interp(time, fine, one) for one in exact])
    early = (true > 0) & (true < 1)
    assert np.abs(found - true)[early].max() < 0.5 * np.abs(smoothed - true)[early].max()


def test_a_law_of_full_contact_has_as_many_knots_as_the_closing_plates_ask_for() -> None:
    block, start = coarse(HEAT)
    assert is_unexplained(start.chi2, start.chi2, SETTINGS)
    finer = _finer(block, start, SETTINGS)
    assert finer is not None
    now = _followed(block, finer, SETTINGS)
    assert block.finer[HEAT] > 0
    assert not is_unexplained(now.chi2, now.chi2, SETTINGS)


def test_laws_of_full_contact_stay_as_far_as_the_clutch_asks_for_them_beside_those_of_the_piston() -> None:
    block, now = coarse(HEAT, SPEED)
    named = [Finding(("contact",), pair, np.ones(COUNT)) for pair in (HEAT, SPEED)]
    piston = Finding(("clutch",), ("piston rate", "pressure"), np.ones(COUNT))
    after, kept = _backward(block, now, named, [piston], SETTINGS)
    assert [one.pair for one in kept] == [HEAT, piston.pair]
    assert after.laws == (HEAT,)
    assert kept[0].nats > 100 * SETTINGS.nats
    assert [one.pair for one in _backward(block, now, named, [], SETTINGS)[1]] == [HEAT, SPEED]


@pytest.mark.parametrize(("drag", "chosen"), [(60.0, "direction"), (40.0, "piston rate")])
def test_a_law_over_the_rate_is_a_drag_if_that_explains_most_of_it(drag: float, chosen: str) -> None:
    """A law of many knots contains the drag, a single number, and follows its form better."""
    def tried(on: str, nats: float) -> _Tried:
        return _Tried(("piston rate", on), np.array([nats]), coarse(HEAT)[1], 0, 5.0)

    enough = [tried("piston rate", 100.0), tried("pressure", 90.0), tried("direction", drag)]
    assert _plainest(enough, SETTINGS).pair == ("piston rate", chosen)
    assert _plainest(enough[1:], SETTINGS).pair == ("piston rate", "pressure")


def test_a_lag_that_changes_must_lead_other_laws() -> None:
    fitted = coarse(HEAT)[1]
    law = _Tried(("piston rate", "pressure"), np.full(COUNT, 10.0), fitted, 0, 5.0)
    for more, chosen in ((0.3, law.pair), (3.0, ("friction lag", "time"))):
        lag = _Tried(("friction lag", "time"), law.gain + more, fitted, 0, 5.0)
        assert _plainest([lag, law], SETTINGS).pair == chosen
