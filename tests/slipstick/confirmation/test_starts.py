"""Where fits of the simulation begin: an effect of which the parameters of the engagements have taken a part."""

import numpy as np
import pytest

from slipstick.confirmation import SimulationFit, Terms, Traces
from slipstick.confirmation.fit import extended, fit_simulation
from slipstick.confirmation.simulated import RANDOM, SimulatedBench
from slipstick.confirmation.starts import About, searched
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from tests.benches import HEAVY, NOMINAL
from tests.slipstick.confirmation.conftest import recorded

DROOP = 0.15
TERMS = Terms(HEAVY, ("supply_droop",))
"""The line pressure falls with the motor speed, which a valve gain in each engagement makes good."""


@pytest.fixture(scope="module")
def without() -> SimulationFit:
    """The fit without the effect to recordings with it."""
    recordings, _ = recorded(NOMINAL.with_effect("supply_droop", {"droop": DROOP}), 24)
    traces = Traces.of(Scene.of(HEAVY, recordings, NamingSettings()), {}, HEAVY.physics.curves)
    return fit_simulation(traces, Terms(HEAVY), np.zeros((24, len(RANDOM))))


def test_the_start_gives_an_effect_what_parameters_have_taken_of_it(without: SimulationFit) -> None:
    block = SimulatedBench(without.block.traces, TERMS)
    points, shared = About(without.block, without.fitted).start(TERMS)
    assert block.values(shared)[0] == pytest.approx(DROOP, rel=0.3)
    gain = list(RANDOM).index("current_gain")
    assert points[:, gain].std() < 0.5 * without.fitted.points[:, gain].std()
    block.at(searched(block, without.fitted.points))
    assert abs(block.values(block.shared)[0]) < 0.4 * DROOP  # with the parameters held it seems to do little


def test_the_fit_from_there_finds_the_effect(without: SimulationFit) -> None:
    """From the fit without it, with what is left of the effect in the parameters, no step leads to the effect."""
    found = extended(without, TERMS, without.fitted.points)
    assert found.values[0] == pytest.approx(DROOP, rel=0.25)
    assert found.evidence.sum() > without.evidence.sum() + 12
    held = fit_simulation(without.block.traces, TERMS, without.fitted.points)
    assert abs(held.values[0]) < 0.1 * DROOP
    assert held.evidence.sum() < without.evidence.sum() + 12


def test_a_start_within_the_bounds_of_the_coefficients(without: SimulationFit) -> None:
    terms = Terms(HEAVY, ("supply_droop", "stribeck_friction"))
    block = SimulatedBench(without.block.traces, terms)
    _, shared = About(without.block, without.fitted).start(terms)
    assert np.all((block.bounds[0] <= shared) & (shared <= block.bounds[1]))
