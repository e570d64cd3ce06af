"""Laws of full contact while the plates close: the heat on which they depend, and as many knots as they need there."""

from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy

from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.naming.block import Pair
from slipstick.naming.closing import _again, _alike, _backward, _finer, _plainest, _Tried, followed
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.fit import fit
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.piston_laws import of_plates
from slipstick.naming.restarts import evidence_of, settled
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


def with_few_knots() -> tuple[ClutchBlock, CurvedFit]:
    """The same with the law over the heat alone, and a block that a test may change."""
    block, found = coarse(HEAT)
    return copy(block), found


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
    block, start = with_few_knots()
    assert is_unexplained(start.chi2, start.chi2, SETTINGS)
    assert followed(block, start, SETTINGS, least=1e6) is start
    assert not block.finer
    finer = _finer(block, start, SETTINGS)
    assert finer is not None
    now = followed(block, finer, SETTINGS)
    assert block.finer[HEAT] > 0
    assert not is_unexplained(now.chi2, now.chi2, SETTINGS)


def test_a_fit_begins_again_with_the_laws_that_the_one_with_a_further_law_has(monkeypatch: pytest.MonkeyPatch) -> None:
    block, best = with_few_knots()
    other = fit_curved(block, (HEAT, ("piston rate", "pressure")), start=best, iterations=0)
    for module in ("closing", "restarts"):  # a fit is what it begins with
        monkeypatch.setattr(f"slipstick.naming.{module}.fit_curved", lambda *args, **kwargs: fit_curved(
            *args, **{**kwargs, "iterations": 0}))
    early = fit_curved(block, (HEAT,), points=best.points, shared=best.shared, iterations=0)
    again = _again(block, early, other)
    assert again.laws == (HEAT,)
    np.testing.assert_array_equal(again.coefficients[HEAT], other.coefficients[HEAT])
    assert evidence_of(again) > evidence_of(early) + 100 * SETTINGS.nats


def test_laws_of_full_contact_stay_as_far_as_the_clutch_asks_for_them_beside_those_of_the_piston() -> None:
    block, now = coarse(HEAT, SPEED)
    named = [Finding(("contact",), pair, np.ones(COUNT)) for pair in (HEAT, SPEED)]
    piston = Finding(("clutch",), ("piston rate", "pressure"), np.ones(COUNT))
    after, kept = _backward(block, now, named, [piston], SETTINGS)
    assert [one.pair for one in kept] == [HEAT, piston.pair]
    assert after.laws == (HEAT,)
    assert kept[0].nats > 100 * SETTINGS.nats
    assert [one.pair for one in _backward(block, now, named, [], SETTINGS)[1]] == [HEAT, SPEED]
    # A fit that ended below the one without a law says nothing against the law.
    stuck = replace(now, evidence=now.evidence - 1e4)
    assert [one.pair for one in _backward(block, stuck, named[:1], [piston], SETTINGS)[1]] == [HEAT, piston.pair]


@pytest.mark.parametrize(("share", "tied"), [(0.6, True), (0.4, False)])
def test_both_laws_over_the_rate_are_tied_where_each_explains_most_of_the_other(share: float, tied: bool) -> None:
    friction, flow, other = (_Tried(("piston rate", on), np.full(COUNT, nats), coarse(HEAT)[1], 0, 5.0)
                             for on, nats in (("direction", 10.0), ("piston rate", 10 * share), ("pressure", 9.0)))
    assert [one.pair for one in _alike(friction, [other, flow])] == [flow.pair] * tied
    assert _alike(other, [friction, flow]) == []


def test_a_lag_that_changes_must_lead_other_laws() -> None:
    fitted = coarse(HEAT)[1]
    law = _Tried(("piston rate", "pressure"), np.full(COUNT, 10.0), fitted, 0, 5.0)
    for more, chosen in ((0.3, law.pair), (3.0, ("friction lag", "time"))):
        lag = _Tried(("friction lag", "time"), law.gain + more, fitted, 0, 5.0)
        assert _plainest([lag, law], SETTINGS).pair == chosen
