"""Lags of friction and converter that change within an engagement: the kernel, and what is found with it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipstick.clutch.lag import lagged_signal
from slipstick.clutch.model import Model
from slipstick.naming.answer import answer, next_best
from slipstick.naming.closing_fits import changing_lags, fits_with_pairs, lags_beside
from slipstick.naming.curved import CurvedFit
from slipstick.naming.evidence import gains as in_linear_model
from slipstick.naming.evidence import table
from slipstick.naming.fit import fit
from slipstick.naming.full_fits import tried
from slipstick.naming.measured import law_points
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.restarts import evidence_of, settled
from slipstick.naming.search import search
from slipstick.naming.selection import Finding, Rival
from slipstick.naming.settings import NamingSettings
from slipstick.naming.torque_lag import OF_FRICTION
from slipstick.naming.varying_lag import Trail, trailing
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

SETTINGS, COUNT, SEED = NamingSettings(), 24, 5
TIME = np.linspace(0, 1.0, 201)
SIGNAL = np.stack([np.clip(TIME - 0.2, 0, 0.3), np.sin(8 * TIME)])
OVER_SPEED, OVER_SLIP = ("friction lag", "output speed"), ("converter lag", "slip")
LATEST, FROM = 0.05, 15.0  # s, and rad/s


def test_a_constant_lag_is_a_first_order_one() -> None:
    found = SIGNAL + trailing(SIGNAL, np.full(SIGNAL.shape, 0.07), TIME[1])
    np.testing.assert_allclose(found, lagged_signal(SIGNAL, TIME, np.array([0.07])), atol=1e-12)


def test_a_lag_that_changes_follows_its_equation() -> None:
    """A twin with steps of a thousandth of a sample."""
    fine = np.linspace(0, 1.0, 200001)
    lag, signal = 0.05 + 0.04 * np.sin(5 * fine), np.interp(fine, TIME, SIGNAL[0])
    late = np.zeros(fine.shape)
    for t in range(1, len(fine)):
        late[t] = late[t - 1] + (signal[t - 1] - late[t - 1]) / lag[t - 1] * fine[1]
    found = SIGNAL[:1] + trailing(SIGNAL[:1], np.interp(TIME, fine, lag)[None], TIME[1])
    assert np.abs(found[0] - np.interp(TIME, fine, late)).max() < 0.01 * np.ptp(late)


def test_what_trails_is_linear_in_the_lag_about_none_and_its_columns_are_derivatives() -> None:
    short = np.full(SIGNAL.shape, 1e-4)
    ahead, behind = (trailing(SIGNAL, sign * short, TIME[1]) for sign in (-1, 1))
    np.testing.assert_allclose(ahead, -behind, atol=1e-12)
    assert np.abs(trailing(SIGNAL, -1e6 * np.ones(SIGNAL.shape), TIME[1])).max() < 1.01 * np.abs(np.diff(SIGNAL)).max()
    basis, h = np.stack([0.05 * np.ones((2, 201)), SIGNAL], 1), 1e-4
    for lag in (0.03 + 0.02 * np.sin(TIME), np.where(TIME < 0.5, -2 * TIME[1], 0.03)):
        lags = np.tile(lag, (2, 1))
        for column, one in zip(Trail.of(lags, TIME[1]).columns(SIGNAL, basis).transpose(1, 0, 2),
                               basis.transpose(1, 0, 2), strict=True):
            change = trailing(SIGNAL, lags + h * one, TIME[1]) - trailing(SIGNAL, lags - h * one, TIME[1])
            np.testing.assert_allclose(column, change / (2 * h), atol=1e-5 * np.abs(column).max())


@cache
def clutch(latest: float) -> tuple[ClutchBlock, CurvedFit]:
    """The closing piston whose torque lags by `latest` s from a speed of the output on, fitted without laws."""
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)
    block = block_of("clutch", scene)
    assert isinstance(block, ClutchBlock)
    lag = np.where(scene.abscissa("output speed") > FROM, latest, 0.0)
    block.measured = block.measured + trailing(scene.smooth["output_torque"], lag, scene.step)
    return block, settled(block, search(block, np.zeros(1)), np.zeros(1))


def gains(latest: float) -> dict[tuple[str, str], tuple[float, CurvedFit]]:
    """Rises of the evidence with each lag of the friction, and with air in the oil."""
    block, plain = clutch(latest)
    pairs = [*changing_lags(block), OF_FRICTION, ("clearance", "pressure")]
    return {linear.pair: (evidence_of(one) - evidence_of(plain), one)
            for linear, one in fits_with_pairs(block, plain, SETTINGS, pairs)}


def test_a_lag_of_the_friction_is_found_over_what_it_depends_on_and_measured() -> None:
    found = gains(LATEST)
    best, one = found[OVER_SPEED]
    assert best > 100 * SETTINGS.nats
    assert all(gain < best - 100 * SETTINGS.nats for pair, (gain, _) in found.items() if pair != OVER_SPEED)
    law = law_points(one, OVER_SPEED)
    assert (law.unit, law.x_unit, law.up_to) == ("s", "rad/s", "nothing")
    assert law.x is not None
    assert law.change[law.x > 1.5 * FROM].mean() == pytest.approx(LATEST, rel=0.2)
    assert np.abs(law.change[law.x < 0.5 * FROM]).max() < 0.3 * LATEST


def test_lags_that_change_are_not_asked_for_beside_another_law() -> None:
    block, plain = clutch(LATEST)
    assert OVER_SPEED in lags_beside(block, plain)
    assert lags_beside(block, replace(plain, laws=(("clearance", "pressure"),))) == []


def test_no_lag_gains_where_nothing_is_missing() -> None:
    assert all(gain < SETTINGS.nats for gain, _ in gains(0.0).values())


def test_a_lag_of_the_converter_over_the_slip_is_followed_and_measured() -> None:
    block = block_of("input", scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED))
    points, law = np.zeros((COUNT, len(block.random))), block.law(OVER_SLIP)
    assert law.x is not None
    true = np.where((law.x > 0.3 * law.x.max()) & (law.x < 0.7 * law.x.max()), LATEST, 0.0)
    lags = [(OVER_SLIP, np.linalg.lstsq(law.onto, true)[0])]
    block.measured = block.measured + block.base(points, lags) - block.base(points)
    fits = {"input": fit(block)}
    about = table(fits["input"], [OVER_SLIP, ("converter torque", "lag"), ("input torque", "time")])
    right, *others = (tried(fits, one, 0) for one in sorted(in_linear_model([about], [], list(about.further)),
                                                            key=lambda one: one.pair != OVER_SLIP))
    assert all(right.nats > one.nats + 100 * SETTINGS.nats for one in others)
    assert right.its["input"].chi2.mean() < 1.1 < others[0].its["input"].chi2.mean()
    found = law_points(right.its["input"], OVER_SLIP)
    assert found.x is not None
    assert len(found.x) >= len(law.x) - 1  # one next to a slip of 0 is hardly passed
    assert np.abs(found.change - np.interp(found.x, law.x, true)).max() < 0.3 * LATEST


def test_a_lag_that_changes_is_the_effect_of_a_constant_one_and_not_in_the_catalogue() -> None:
    others = [Rival(OF_FRICTION, 90.0, 1.0), Rival(("friction lag", "time"), 80.0, 1.0),
              Rival(("output torque sensor", "lag"), 70.0, 1.0)]
    assert next_best(OVER_SPEED, others) is others[2]
    assert next_best(OF_FRICTION, others) is others[2]
    assert answer(Finding(("clutch",), OVER_SPEED, np.ones(COUNT))).kind == "unlisted"
