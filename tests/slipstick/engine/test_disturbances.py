"""Disturbances: forces that nobody knows drive a mass whose place is read precisely."""

import numpy as np
import pytest

from slipstick.engine.measured_law import measure
from slipstick.engine.noise import Noise, draw_noise
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.engine.selection import Identification, identify
from slipstick.engine.settings import EngineSettings
from slipstick.engine.settling import settle
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor
from slipstick.numerics.piecewise import hats

RUNS, STEP, READ = 30, 0.01, 1e-4
TIME = STEP * np.arange(200)
DISTURBANCE = Noise(0.3, 0.8)


def declare(largest: float, scatter: float = 0.02) -> Machine:
    mass = Block("mass", gives="pace", reads=("drive",), states=("pace",),
                 parameters=(Parameter("drag", value=1.0, scatter=scatter),),
                 quantities=(Quantity("push", size=1.0, disturbance=largest),))
    mass.rate(lambda x, u, q, p: u.drive - p.drag * x.pace - q.push)
    return Machine("mass", (mass,), (Sensor("pace"),), commands=(Command("drive"),))


def record(push: float = 0.0) -> Runs:
    """A mass with a drag of 1.1, and a push against it above a pace of 0.3."""
    rng, fine, corners = np.random.default_rng(5), 20, np.linspace(0, TIME[-1], 5)
    drive = rng.uniform(-2, 2, (RUNS, 5))
    disturbance = draw_noise(DISTURBANCE, (RUNS, len(TIME)), rng)
    instants = np.linspace(0, TIME[-1], fine * (len(TIME) - 1) + 1)
    force = np.array([np.interp(instants, corners, row) - np.interp(instants, TIME, own)
                      for row, own in zip(drive, disturbance, strict=True)])
    pace = np.zeros_like(force)
    for j in range(len(instants) - 1):
        lost = 1.1 * pace[:, j] + push * np.maximum(pace[:, j] - 0.3, 0)
        pace[:, j + 1] = pace[:, j] + STEP / fine * (force[:, j] - lost)
    read = pace[:, ::fine] + READ * rng.standard_normal((RUNS, len(TIME)))
    profile = Profile(np.tile(corners, (RUNS, 1)), drive)
    return Runs(TIME, {"pace": read}, {"drive": profile}, order=rng.permutation(RUNS).astype(float))


def prepare_runs(largest: float, push: float = 0.0, scatter: float = 0.02) -> Recorded:
    return prepare(declare(largest, scatter), record(push))


@pytest.fixture(scope="module")
def pushed() -> Identification:
    return identify(prepare_runs(1.0, push=2.0))


@pytest.mark.parametrize("scatter", [0.02, 0.0])
def test_a_disturbance_is_what_a_fit_leaves(scatter: float) -> None:
    [fitted] = settle(prepare_runs(1.0, scatter=scatter), EngineSettings())

    noise = fitted.recorded.parts[0].disturbances["push"]

    assert noise.std == pytest.approx(DISTURBANCE.std, rel=0.1)
    assert noise.correlation == pytest.approx(DISTURBANCE.correlation, abs=0.05)
    assert fitted.chi_square["mass"].mean() == pytest.approx(1.0, abs=0.1)
    assert np.exp(fitted.state.points.mean() if scatter else fitted.state.shared[0]) == pytest.approx(1.1, abs=0.03)


def test_it_is_no_larger_than_declared() -> None:
    [fitted] = settle(prepare_runs(0.1), EngineSettings())
    assert fitted.recorded.parts[0].disturbances["push"].std == pytest.approx(0.1, rel=1e-6)
    assert fitted.recorded.parts[0].temper[0] > 2


def test_nothing_is_named_where_nothing_but_a_disturbance_is_missing() -> None:
    answer = identify(prepare_runs(1.0))
    assert not answer.findings
    assert not answer.unexplained


def test_a_law_beside_a_disturbance_is_named_and_measured(pushed: Identification) -> None:
    assert pushed.findings[0].pair == ("push", "pace")
    assert not pushed.unexplained
    law = measure(pushed.fits[0], ("push", "pace"))
    weights = hats(np.array([[0.8, 0.3, 0.2, -0.3]]), law.x)[0] @ [1, -1, -1, 1]
    bend = float(weights @ law.change)
    error = float(np.sqrt(weights @ law.covariance @ weights))
    assert bend == pytest.approx(2.0 * 0.5, abs=3 * error)  # no line has this
