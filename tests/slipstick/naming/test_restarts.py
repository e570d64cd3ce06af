"""Fits of the closing piston from other places find what steps from one fit do not reach."""

from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.naming import start
from slipstick.naming.block import Laws
from slipstick.naming.curved import CurvedFit, fit_curved
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.restarts import annealed, evidence_of, regained, settled
from slipstick.naming.search import search
from slipstick.naming.settings import NamingSettings
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import block_of, scene_of

SPRING = ("piston rate", "piston position")
OTHER = ("film torque", "slip")
NATS = NamingSettings().nats


@cache
def fitted(stiffening: float) -> tuple[ClutchBlock, CurvedFit]:
    """The closing piston of 12 engagements with a nonlinear return spring, and its fit without a law."""
    effects: Mapping[str, Mapping[str, float]] = {"return_spring": {"stiffening": stiffening}} if stiffening else {}
    block = block_of("clutch", scene_of(HEAVY, Model(HEAVY.physics, effects=effects), 12, seed=3))
    assert isinstance(block, ClutchBlock)
    return block, settled(block, search(block, np.zeros(1)), np.zeros(1))


@pytest.mark.slow
def test_a_strong_law_is_found_from_nominal_points_with_a_loud_noise_first() -> None:
    block, without = fitted(-0.15)
    assert (without.variance >= block.widest**2).any()  # engagements stand for what the law would explain
    stuck = fit_curved(block, [SPRING], start=without, iterations=10)
    assert evidence_of(stuck) - evidence_of(without) < NATS
    found = fit_curved(block, [SPRING], start=annealed(block, without, SPRING), iterations=10)
    assert evidence_of(found) - evidence_of(without) > 100 * NATS


def test_a_wrong_law_does_not_gain_by_it() -> None:
    block, without = fitted(-0.15)
    wrong = fit_curved(block, [OTHER], start=annealed(block, without, OTHER), iterations=10)
    assert evidence_of(wrong) - evidence_of(without) < NATS


@pytest.mark.parametrize("pair", [SPRING, OTHER])
def test_no_law_gains_where_nothing_is_missing(pair: tuple[str, str]) -> None:
    block, without = fitted(0.0)
    found = fit_curved(block, [pair], start=annealed(block, without, pair), iterations=10)
    assert evidence_of(found) - evidence_of(without) < NATS


def test_the_noise_is_that_of_the_sensor_again() -> None:
    block, without = fitted(0.0)
    noise = block.scene.noise
    annealed(block, without, SPRING)
    assert block.scene.noise == noise


def test_engagements_that_a_fit_misses_are_found_about_the_others() -> None:
    block, without = fitted(0.0)
    lost = without.points.copy()
    lost[:3] += np.array([0.0, -0.6, 0.9, 0.0, 0.0, 0.0, 0.0])  # pressure bias and initial position
    missed = fit_curved(block, points=lost, shared=without.shared, iterations=8)
    counted = block.counted.copy()
    found = regained(block, missed)
    assert evidence_of(missed) < evidence_of(without) - 1000 * NATS
    assert evidence_of(found) > evidence_of(without) - 3 * NATS
    assert np.array_equal(block.counted, counted)


def test_some_engagements_alone_have_the_same_torque() -> None:
    block, without = fitted(0.0)
    rows = np.arange(12) % 3 == 1
    torque = block.at(without.shared).part(without.points, (), rows)
    np.testing.assert_array_equal(torque[rows], block.at(without.shared).base(without.points)[rows])
    assert not torque[~rows].any()


def test_a_fit_that_misses_none_is_kept() -> None:
    block, without = fitted(0.0)
    assert regained(block, without) is without


# A second start of the blocks begins where the first one ended as well: a search may end in another minimum.


def test_what_is_known_of_the_onset_makes_up_for_a_search_that_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), 18, seed=3)
    pressure = scene.smooth["pressure"]

    def chi_square(known: start.Onset | None) -> float:
        return float(start._rough(scene, pressure, None, known).chi2.mean())

    right = start._rough(scene, pressure, None, None)
    assert right.chi2.mean() < 1.2

    def failing(block: ClutchBlock, shared: np.ndarray, laws: Laws = ()) -> np.ndarray:
        points = np.zeros((len(block.measured), len(block.random)))
        points[:, 1:3] = -0.8, 1.9  # pressure bias and initial position: in contact from the beginning
        return points

    monkeypatch.setattr(start, "search", failing)
    monkeypatch.setattr(start, "retimed", lambda block, points, shared, laws: points)
    assert chi_square(None) > 10
    assert chi_square(start.Onset(right.points, right.shared, {})) < 1.2
    assert chi_square(start.Onset(failing(right.block, right.shared), right.shared, {})) == chi_square(None)
