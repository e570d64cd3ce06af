"""Parameters that scatter beside values that all runs share, where equations are not linear in them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipstick.engine import fit as fits
from slipstick.engine.columns import Columns, fit_columns, join_columns
from slipstick.engine.fit import Fit
from slipstick.engine.laws import list_candidates
from slipstick.engine.preparation import prepare
from slipstick.engine.priors import Prior
from slipstick.engine.recordings import Recorded
from slipstick.engine.simulation import simulate_runs
from slipstick.engine.study import estimate_parameters
from slipstick.machine import Block, Command, Machine, Parameter, Quantity, Sensor, list_experiments

TRUE = {"resistance": 1.2, "torque constant": 0.051, "inertia": 2.1e-4, "viscous friction": 1.3e-4}
"""The voltage and the speed tell gain and time constant of a run, which three of these make up for each other."""


def declare_drive(bent: float = 0.0) -> Machine:
    """A motor with a viscous friction that is bent over the speed."""
    shaft = Block("shaft", gives="speed", reads=("voltage",), states=("speed",), parameters=(
        Parameter("resistance", "ohm", value=1.2, within=0.05, scatter=0.04),
        Parameter("torque constant", "N m/A", value=0.05, within=0.05, scatter=0.0),
        Parameter("inertia", "kg m^2", value=2e-4, within=0.1, scatter=0.0),
        Parameter("viscous friction", "N m s", value=1.2e-4, within=0.5, scatter=0.1)),
        quantities=(Quantity("friction change", relative=True),))

    @shaft.rate
    def turn(x, u, q, p):  # type: ignore[no-untyped-def]
        current = (u.voltage - p.torque_constant * x.speed) / p.resistance
        friction = p.viscous_friction * x.speed * (1 + q.friction_change) * (1 + bent * np.abs(x.speed))
        return (p.torque_constant * current - friction) / p.inertia

    voltage = (0, 0), (0.05, 0), (0.051, 10), (0.4, 8), (0.401, -6), (0.8, -4)
    return Machine("drive", (shaft,), (Sensor("speed", "rad/s", noise=0.4),),
                   commands=(Command("voltage", "V", profiles=(voltage,)),), duration=0.8, step=0.004)


@pytest.fixture(scope="module")
def recorded() -> Recorded:
    machine = declare_drive()
    return prepare(machine, simulate_runs(machine, list_experiments(machine).take(np.zeros(24, int)), TRUE, seed=1))


def list_errors(fitted: Fit) -> dict[str, float]:
    """Return by how many standard errors the mean of each parameter is off."""
    return {each.name: (each.mean - TRUE[each.name]) / each.error for each in estimate_parameters(fitted)}


def follow_own(*arguments: Any) -> Columns:
    """Columns of each run's own parameters."""
    columns = fit_columns(*arguments)
    return replace(columns, shift=np.zeros_like(columns.shift))


def test_shared_values_make_no_scatter_smaller(recorded: Recorded, monkeypatch: pytest.MonkeyPatch) -> None:
    fitted = fits.fit(recorded, {}, {})
    assert fitted.converged
    assert max(map(abs, list_errors(fitted).values())) < 1
    monkeypatch.setattr(fits, "fit_columns", follow_own)
    own = fits.fit(recorded, {}, {})
    assert not own.converged
    assert max(map(abs, list_errors(own).values())) > 3


@pytest.mark.parametrize("growth", [150.0, 2000.0])
def test_equations_may_diverge_at_the_means_alone(growth: float) -> None:
    """Those with a law that is tried may do so: their columns are the same but for a factor, or not finite."""
    block = Block("amplifier", gives="level", reads=("voltage",), states=("level",), parameters=(
        Parameter("growth", "1/s", value=0.0, scale=1.0, scatter=0.5), Parameter("gain", "1/s", value=5.0),
        Parameter("offset", "V/s", value=0.0, scale=1.0, scatter=0.5),
        Parameter("leakage", "1/s", value=5.0, scatter=0.0)), quantities=(Quantity("level change", relative=True),))

    @block.rate
    def amplify(x, u, q, p):  # type: ignore[no-untyped-def]
        return p.gain * u.voltage + p.offset + (p.growth - p.leakage * (1 + q.level_change)) * x.level

    machine = Machine("amplifier", (block,), (Sensor("level", "V", noise=0.01),), commands=(
        Command("voltage", "V", profiles=(((0, 0), (0.1, 1), (0.5, -1), (1, 2)),)),), duration=1.0, step=0.01)
    drawn = simulate_runs(machine, list_experiments(machine).take(np.zeros(24, int)), seed=1)
    fitted = fits.fit(prepare(machine, drawn), {}, {})
    far = replace(fitted.state, means=np.array([growth, 0.0, 0.0]))
    with np.errstate(over="ignore", invalid="ignore"):
        assert np.isfinite(fit_columns(fitted.recorded, {}, far).shift).all()


def test_columns_of_groups_that_share_nothing_are_those_of_all() -> None:
    random = np.random.default_rng(1)
    groups = [Columns({}, random.normal(size=(3, *size))) for size in ((2, 4), (1, 3))]
    joined = join_columns(groups, [1, 2]).shift
    np.testing.assert_array_equal(joined[:, :2, [0, 3, 4, 5]], groups[0].shift)
    np.testing.assert_array_equal(joined[:, 2:, [1, 2, 6]], groups[1].shift)
    assert np.count_nonzero(joined) == 3 * (2 * 4 + 3)


def test_priors_are_adapted_where_that_is_more_likely(monkeypatch: pytest.MonkeyPatch) -> None:
    """About a solution with a law, parameters beyond their reach may replace it, so that none is the adapted prior."""
    machine = declare_drive()
    bent = simulate_runs(declare_drive(0.0075), list_experiments(machine).take(np.zeros(24, int)), TRUE, seed=1)
    bare = fits.fit(prepare(machine, bent), {}, {})
    [law] = [each for each in list_candidates(bare.recorded, {name: model.own() for name, model in bare.models.items()})
             if each.pair == ("friction change", "speed")]
    named = bare.beside({law.pair: law}, {law.pair: Prior(1.0, 0.3, 1)})
    assert named.evidence > bare.evidence + 1000
    monkeypatch.setattr(fits, "adapt_priors", lambda *_: {law.pair: Prior(1e-4, 0.0, 1)})
    assert fits.fit(named.recorded, named.laws, named.priors, named.state).evidence > named.evidence - 1


def test_a_run_with_a_flipped_sign_leaves_what_no_parameter_that_it_may_have_explains() -> None:
    """By a linear model it would leave nothing, with a gain of -1."""
    block = Block("stage", gives="level", reads=("voltage",), states=("level",), parameters=(
        Parameter("gain", "1", value=1.0, scatter=0.02),))

    @block.rate
    def rise(x, u, q, p):  # type: ignore[no-untyped-def]
        return 10 * (p.gain * u.voltage - x.level)

    machine = Machine("stage", (block,), (Sensor("level", "V", noise=0.01),),
                      commands=(Command("voltage", "V", profiles=(((0, 0), (0.1, 0), (0.2, 1), (1, 1)),)),),
                      duration=1.0, step=0.01)
    runs = simulate_runs(machine, list_experiments(machine).take(np.zeros(10, int)), seed=1)
    runs.signals["level"][3] *= -1
    fitted = fits.fit(prepare(machine, runs), {}, {})
    assert fitted.state.points[3] == -0.8
    assert fitted.chi_square["stage"][3] > 1000
    # On the way, linear models lead further, and what they left there would count as noise.
    points = np.maximum(fitted.state.points, -0.5)
    within = replace(fitted, state=replace(fitted.state, points=points))
    assert within.chi_square["stage"][3] < 0.1 * fitted.chi_square["stage"][3]
    assert np.delete(fitted.chi_square["stage"], 3).max() < 1.5
