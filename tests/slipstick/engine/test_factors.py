"""Positive parameters are factors: what acts in ratios alone is known up to one mean, at any scatter."""

import numpy as np
import pytest

from slipstick.engine.evidence import multiply, screen
from slipstick.engine.fit import Fit
from slipstick.engine.laws import list_candidates
from slipstick.engine.preparation import prepare
from slipstick.engine.settling import fit_bare
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor

RUNS, STEPS, WITHIN = 40, 20, 0.03
TIME, CORNERS = np.linspace(0, 4, 81), np.linspace(0, 4, 5)


def declare() -> Machine:
    """A tank whose gain, outlet and area may all be larger by the same factor: only the area's prior tells the size."""
    tank = Block("tank", gives="level", reads=("flow",), states=("level",),
                 parameters=(Parameter("gain", value=1.0), Parameter("outlet", value=1.0),
                             Parameter("area", value=1.0, within=WITHIN),
                             Parameter("start", first_of="level", scale=0.1, scatter=1, within=1)),
                 quantities=(Quantity("outflow", relative=True),))
    tank.rate(lambda x, u, q, p: (p.gain * u.flow - p.outlet * (1 + q.outflow) * x.level) / p.area)
    tank.start(lambda u, q, p: p.start)
    return Machine("tank", (tank,), (Sensor("level"),), commands=(Command("flow"),))


@pytest.fixture(scope="module")
def fitted() -> Fit:
    rng = np.random.default_rng(1)
    profile = Profile(np.tile(CORNERS, (RUNS, 1)), rng.uniform(0.5, 2, (RUNS, len(CORNERS))))
    gain, outlet, area = np.exp(0.05 * rng.standard_normal((3, RUNS)))
    level = rng.uniform(0.5, 1.5, RUNS)
    instants = np.linspace(0, 4, STEPS * (len(TIME) - 1) + 1)
    flow, levels = profile.at(instants), [level]
    # Between two instants the flow is close to its mean, for which the solution is known.
    for step, passing in enumerate(0.5 * (flow[:, :-1] + flow[:, 1:]).T):
        end = gain * passing / outlet
        level = end + (level - end) * np.exp(-outlet / area * (instants[1] - instants[0]))
        if (step + 1) % STEPS == 0:
            levels.append(level)
    signal = np.stack(levels, axis=1) + 0.002 * rng.standard_normal((RUNS, len(TIME)))
    return fit_bare(prepare(declare(), Runs(TIME, {"level": signal}, {"flow": profile})))


def test_a_common_factor_stays_where_its_prior_is_although_the_runs_scatter(fitted: Fit) -> None:
    """With additive changes, the area ends 7 % too small: smaller means make the deviations of the runs smaller."""
    assert fitted.converged
    names = [term.name for term in fitted.recorded.random]
    place = names.index("area")
    assert fitted.means[place] == pytest.approx(0, abs=0.1 * WITHIN)
    assert np.sqrt(fitted.fitted.covariance[place, place]) == pytest.approx(WITHIN, rel=0.05)
    assert fitted.means[names.index("gain")] - fitted.means[names.index("outlet")] == pytest.approx(0, abs=0.03)


@pytest.mark.parametrize("on", ["flow", "offset"])
def test_a_constant_share_of_the_outflow_is_that_of_the_outlet(fitted: Fit, on: str) -> None:
    own = {name: model.own() for name, model in fitted.models.items()}
    candidate = next(each for each in list_candidates(fitted.recorded, own) if each.pair == ("outflow", on))
    screened = screen(fitted, [candidate], multiply(fitted.models, [candidate]))[0]
    assert screened.prior.known_up_to == 1
    assert screened.nats < 3
