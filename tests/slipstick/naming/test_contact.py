"""When the plates touch, close, lock and part: the pressure, the samples and the laws that count."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy

from slipstick.bench.conditions import Conditions
from slipstick.blocks import Valve
from slipstick.clutch import ensemble
from slipstick.clutch.laws import MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.naming.block import Pair
from slipstick.naming.closing import _again, _alike, _backward, _finer, _plainest, _Tried, followed
from slipstick.naming.contact import WAIT, ContactBlock
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.fit import fit
from slipstick.naming.forward import forward
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.piston_laws import of_plates
from slipstick.naming.release import released, slips_until
from slipstick.naming.restarts import evidence_of, settled
from slipstick.naming.scene import Scene
from slipstick.naming.search import search
from slipstick.naming.selection import Finding, is_unexplained
from slipstick.naming.settings import NamingSettings
from slipstick.naming.valve import ValveBlock, deviations_along_axes
from tests.benches import HEAVY, NOMINAL
from tests.slipstick.naming.engagements import block_of, scene_of

COUNT, SEED = 24, 3
NOTHING = np.zeros((COUNT, 7))


def test_a_late_pressure_is_that_of_the_valve_between_two_samples() -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT)
    block, points = ValveBlock(scene), np.zeros((COUNT, 3))
    for late in (0.3 * scene.step, scene.step):
        exact = Valve(scene.recordings.conditions, scene.time - late).predict(np.tile(scene.base, (COUNT, 1)))
        np.testing.assert_allclose(block.pressure(points, late=late), exact, atol=1e-9)
    laws = [(("valve current", "past current"), np.array([0.01, *[0.0] * 6]))]
    np.testing.assert_allclose(block.pressure(points, laws, scene.step)[:, 1:], block.pressure(points, laws)[:, :-1],
                               atol=1e-9)


def test_a_late_clutch_reads_the_late_pressure_and_not_one_that_is_linear_between_samples() -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT)
    pressure = scene.smooth["pressure"]
    late = np.array([0.5 * scene.step])
    exact, linear = (ClutchBlock(scene, pressure, other).at(late) for other in (lambda late: pressure + late, None))
    np.testing.assert_array_equal(exact._inputs[0], pressure + late)
    np.testing.assert_allclose(linear._inputs[0][:, 1:], 0.5 * (pressure[:, 1:] + pressure[:, :-1]), atol=1e-12)


def contact(scatter: float, known: bool) -> tuple[float, list[Pair]]:
    """Chi-square of full contact and what it asks for, where the delays of the valve are off by a share `scatter`."""
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)
    covariance = np.tile(np.diag([scatter**2, 0.0, 0.0]), (COUNT, 1, 1))
    modes = ValveBlock(scene).changes(np.zeros((COUNT, 3)), (), deviations_along_axes(covariance))
    weights = np.random.default_rng(SEED).normal(size=(COUNT, 3))
    pressure = scene.smooth["pressure"] + np.einsum("nr,nrk->nk", weights, modes)
    block = ContactBlock(replace(scene, pressure_modes=modes if known else None), pressure, NOTHING)
    found = fit(block)
    return float(found.chi2.mean()), [one.pair for one in forward({"contact": found}, NamingSettings())[1]]


def test_full_contact_is_explained_if_it_is_known_how_far_the_pressure_is() -> None:
    chi_square, findings = contact(0.1, known=True)
    assert chi_square == pytest.approx(1, abs=0.05)
    assert findings == []
    assert contact(0.1, known=False)[0] > 1.3
    assert contact(0.0, known=True)[0] == pytest.approx(1, abs=0.05)


def test_an_error_of_the_means_of_the_valve_is_no_law_of_the_friction() -> None:
    """The bias is 10 % off in all engagements, which raises their pressure alike."""
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)
    means = ValveBlock(scene).changes(np.zeros((COUNT, 3)), (), np.tile([[0.0], [0.1], [0.0]], (COUNT, 1, 1)))
    for known in (True, False):
        told = replace(scene, pressure_means=means if known else None)
        found = fit(ContactBlock(told, scene.smooth["pressure"] + means[:, 0], NOTHING))
        assert found.chi2.mean() == pytest.approx(1, abs=0.05) if known else found.chi2.mean() > 1.3
        assert (forward({"contact": found}, NamingSettings())[1] == []) is known


# Full contact is where the plates touch, also in an engagement in which they part and meet again.


PARTED = 6


def parted(scene: Scene) -> np.ndarray:
    """The pressure (n, k) in bar with a gap after the plates have met, in all engagements but the first."""
    pressure, step = scene.smooth["pressure"].copy(), scene.step
    met = np.argmax(ClutchBlock(scene, pressure).contact(np.zeros((PARTED, 7))).full > 0, axis=1)
    for i in range(1, PARTED):
        first = met[i] + round(0.06 / step)
        pressure[i, first:first + round(0.2 / step)] = 0.0
    return pressure


def test_samples_near_a_parting_do_not_count_and_those_after_the_next_contact_do() -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), PARTED)
    # Late enough for a gap and another contact before lock-up.
    scene = replace(scene, recordings=replace(scene.recordings, measured_time=np.full(PARTED, scene.time[-2])))
    pressure, nothing = parted(scene), np.zeros((PARTED, 7))
    clutch = ClutchBlock(scene, pressure)
    position = clutch._closed(nothing, (), clutch.end)[1]
    counted = ContactBlock(scene, pressure, nothing).counted
    apart = position < scene.value("contact_position")
    wait = round(WAIT / scene.step)
    for i in range(PARTED):
        touching = np.flatnonzero(~apart[i, :clutch.end[i]])
        breaks = np.count_nonzero(np.diff(touching) > 1)
        assert breaks == (i > 0)
        near = np.convolve(apart[i], np.ones(2 * wait + 1), "same") > 0
        near[clutch.end[i] - wait:] = False  # lock-up is no parting
        assert not (counted[i] & near).any()
        assert counted[i, touching[-1] - wait]  # up to lock-up
        if i:
            gap = touching[np.argmax(np.diff(touching) > 1)]
            assert counted[i, :gap].any()
            assert counted[i, gap:].any()


# Samples of slip end at lock-up, and samples after lock-up where the plates may slip again.


TIME = np.arange(0.0, 3.0, 2e-3)
FALLS = np.array([[0, 0.002, 0.105, 0.115, 0.255, 0.8, 1.2, 1.6, 2.4, 3.2]])
CURRENT = np.array([[0.1, 0.7, 0.7, 0.3, 0.3, 0.7, 0.7, 0.15, 0.15, 0.15]])


def engagement(current: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What `released` finds, (k,), and where the plates slip after lock-up."""
    conditions = Conditions(np.zeros(1, np.int64), np.array([105.0]), np.array([6.0]), np.array([80.0]), FALLS, current)
    response = ensemble.signals(NOMINAL, conditions, TIME, accuracy=ensemble.TIGHT)
    locks = response.shifting_time[0, 0]
    found = released(response.output_torque[0], response.pressure[0], (locks - 0.01 > TIME)[None],
                     (locks + 0.01 < TIME)[None])[0]
    slip = response.input_speed[0, 0] / 3.2 - response.output_speed[0, 0]
    return found, (np.abs(slip) > 1e-3) & (locks + 0.01 < TIME)


def test_where_the_pressure_falls_the_plates_slip_again_and_are_released_before() -> None:
    found, slips = engagement(CURRENT)
    assert slips.sum() > 100
    assert np.all(found[slips])
    assert TIME[np.argmax(slips)] - 0.1 < TIME[np.argmax(found)] <= TIME[np.argmax(slips)]
    assert np.all(np.diff(found.astype(int)) >= 0)  # from there on


@pytest.mark.parametrize("last", [0.7, 0.6])
def test_plates_that_stay_locked_are_not_released(last: float) -> None:
    found, slips = engagement(np.where(FALLS > 1.5, last, CURRENT))
    assert not slips.any()
    assert not found.any()


def late(error: float, noise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What `slips_until` finds, (2, k), where the plates slip, and what is before a shifting time late by `error` s."""
    locks = np.array([0.6, 0.9])[:, None]
    slip = 100.0 * np.sqrt(np.maximum(1 - TIME / locks, 0))
    random = np.random.default_rng(2)
    measured = 3.0 + slip + noise * random.standard_normal(slip.shape)  # with an offset of the speeds
    before = locks + error - 0.01 > TIME
    return slips_until(measured, locks + error + 0.01 < TIME), slip > 0, before


def test_samples_after_a_lock_up_that_was_measured_late_are_not_taken_for_slip() -> None:
    found, slips, before = late(0.05, 0.5)
    assert np.any(before & ~slips)
    assert not np.any(before & found & ~slips)
    assert np.all(found[slips].reshape(-1)[:100])
    assert (slips & ~found).sum() < 10  # near lock-up
    found, slips, before = late(0.0, 0.5)
    assert (before & ~found).sum() < 10


def test_without_samples_after_lock_up_all_are_taken_for_slip() -> None:
    slip = np.ones((2, 30))
    assert np.all(slips_until(slip, np.zeros(slip.shape, bool)))


# Laws of full contact while the plates close: the heat on which they depend, and as many knots as they need there.


CLOSING, CLOSING_SEED, SETTINGS = 24, 5, NamingSettings()
HEAT, RUN_ORDER = ("friction coefficient", "heat"), ("friction coefficient", "run order")
AT = np.linspace(0, 6.0, 16)  # kJ
WAVE = MeasuredLaw(*HEAT, tuple(AT), tuple(0.1 * np.sin(AT * 2 * np.pi / 3.6)), relative=True)


@cache
def coarse(*laws: Pair) -> tuple[ClutchBlock, CurvedFit]:
    """The clutch with laws of full contact, that over the heat with few knots, of a friction that depends on the heat.
    """
    scene = scene_of(HEAVY, Model(HEAVY.physics).with_law(WAVE), CLOSING, CLOSING_SEED)
    block, contact = block_of("clutch", scene), fit(block_of("contact", scene), laws)
    assert isinstance(block, ClutchBlock)
    found = search(block, np.zeros(1), contact.held)
    return block, settled(block, found, np.zeros(1), contact.laws, contact.coefficients)


def heats(sample_time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (k,) in s, and heat (n, k) in kJ of the plates, also as a smoothed torque gives it."""
    block = block_of("clutch", scene_of(replace(HEAVY, sample_time=sample_time), Model(HEAVY.physics), CLOSING))
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
    _, start = coarse(HEAT)
    assert is_unexplained(start.chi2, start.chi2, SETTINGS)
    assert followed(start, SETTINGS, least=1e6) is start
    finer = _finer(start, SETTINGS)
    assert finer is not None
    now = followed(finer, SETTINGS)
    assert now.block.finer[HEAT] > 0
    assert not start.block.finer
    assert not is_unexplained(now.chi2, now.chi2, SETTINGS)


def test_a_fit_begins_again_with_the_laws_that_the_one_with_a_further_law_has(monkeypatch: pytest.MonkeyPatch) -> None:
    block, best = coarse(HEAT)
    other = fit_curved(block, (HEAT, ("piston rate", "pressure")), start=best, iterations=0)
    for module in ("closing", "restarts"):  # a fit is what it begins with
        monkeypatch.setattr(f"slipstick.naming.{module}.fit_curved", lambda *args, **kwargs: fit_curved(
            *args, **{**kwargs, "iterations": 0}))
    early = fit_curved(block, (HEAT,), points=best.points, shared=best.shared, iterations=0)
    again = _again(early, other)
    assert again.laws == (HEAT,)
    np.testing.assert_array_equal(again.coefficients[HEAT], other.coefficients[HEAT])
    assert evidence_of(again) > evidence_of(early) + 100 * SETTINGS.nats


def test_laws_of_full_contact_stay_as_far_as_the_clutch_asks_for_them_beside_those_of_the_piston() -> None:
    _, now = coarse(HEAT, RUN_ORDER)
    named = [Finding(("contact",), pair, np.ones(CLOSING)) for pair in (HEAT, RUN_ORDER)]
    piston = Finding(("clutch",), ("piston rate", "pressure"), np.ones(CLOSING))
    after, kept = _backward(now, named, [piston], SETTINGS)
    assert [one.pair for one in kept] == [HEAT, piston.pair]
    assert after.laws == (HEAT,)
    assert kept[0].nats > 100 * SETTINGS.nats
    assert [one.pair for one in _backward(now, named, [], SETTINGS)[1]] == [HEAT, RUN_ORDER]
    # A fit that ended below the one without a law says nothing against the law.
    stuck = replace(now, evidence=now.evidence - 1e4)
    assert [one.pair for one in _backward(stuck, named[:1], [piston], SETTINGS)[1]] == [HEAT, piston.pair]


@pytest.mark.parametrize(("share", "tied"), [(0.6, True), (0.4, False)])
def test_both_laws_over_the_rate_are_tied_where_each_explains_most_of_the_other(share: float, tied: bool) -> None:
    friction, flow, other = (_Tried(("piston rate", on), np.full(CLOSING, nats), coarse(HEAT)[1], 5.0)
                             for on, nats in (("direction", 10.0), ("piston rate", 10 * share), ("pressure", 9.0)))
    assert [one.pair for one in _alike(friction, [other, flow])] == [flow.pair] * tied
    assert _alike(other, [friction, flow]) == []


def test_a_lag_that_changes_must_lead_other_laws() -> None:
    fitted = coarse(HEAT)[1]
    law = _Tried(("piston rate", "pressure"), np.full(CLOSING, 10.0), fitted, 5.0)
    for more, chosen in ((0.3, law.pair), (3.0, ("friction lag", "time"))):
        lag = _Tried(("friction lag", "time"), law.gain + more, fitted, 5.0)
        assert _plainest([lag, law], SETTINGS).pair == chosen
