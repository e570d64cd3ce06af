"""The clutch is driven by a pressure that is exact between samples, and known as well as the valve block knows it."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.blocks import Valve
from slipstick.clutch.model import Model
from slipstick.naming.block import Pair
from slipstick.naming.contact import ContactBlock
from slipstick.naming.fit import fit
from slipstick.naming.forward import forward
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.settings import NamingSettings
from slipstick.naming.valve import ValveBlock
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

COUNT, SEED = 36, 3
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
    exact, linear = ClutchBlock(scene, pressure, lambda late: pressure + late), ClutchBlock(scene, pressure)
    late = np.array([0.5 * scene.step])
    exact.at(late)
    linear.at(late)
    np.testing.assert_array_equal(exact._inputs[0], pressure + late)
    np.testing.assert_allclose(linear._inputs[0][:, 1:], 0.5 * (pressure[:, 1:] + pressure[:, :-1]), atol=1e-12)


def contact(scatter: float, known: bool) -> tuple[float, list[Pair]]:
    """Chi-square of full contact and what it asks for, where the delays of the valve are off by a share `scatter`."""
    scene = scene_of(HEAVY, Model(HEAVY.physics), COUNT, SEED)
    covariance = np.tile(np.diag([scatter**2, 0.0, 0.0]), (COUNT, 1, 1))
    modes = ValveBlock(scene).modes(np.zeros((COUNT, 3)), (), covariance)
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
