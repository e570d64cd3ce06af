"""Kinds of laws over a state that moves over several knots of the law in each step."""

import numpy as np
import pytest

from slipstick.engine.kinds import KindOfLaw, find_kind
from slipstick.engine.preparation import prepare
from slipstick.engine.selection import identify
from slipstick.engine.simulation import simulate
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor

RUNS, NOISE, SLOPE, LIMIT = 24, 2e-4, -1.0, 0.15
PAIR = "flow", "spool"


def declare(limit: float = 0.0) -> Machine:
    """A valve whose spool drives a cylinder, and has no flow up to a `limit` in V."""
    cylinder = Block("cylinder", gives="position", reads=("voltage",), states=("spool", "position"),
                     parameters=(Parameter("lag", "s", value=0.03, within=0.1),
                                 Parameter("gain", "m/(s V)", value=0.1)),
                     quantities=(Quantity("flow", "V", size=0.3, over=("spool",)),))
    cylinder.rate(lambda x, u, q, p: ((u.voltage - x.spool) / p.lag, p.gain * (
        x.spool + q.flow - np.minimum(limit, np.maximum(-limit, x.spool)))))
    errors = "voltage", "position", "spool", "time", "run order", "lag", "offset"
    return Machine("cylinder", (cylinder,), (Sensor("position", "m", without=errors),), (Command("voltage", "V"),))


def find(seed: int, step: float) -> KindOfLaw:
    """The kind of the law of runs with the dead band."""
    rng, time, corners = np.random.default_rng(seed), np.arange(0, 2 + step / 2, step), np.linspace(0, 2, 41)
    reach = rng.uniform(0.5, 2.0, (RUNS, 1))
    waves = np.sin(np.pi * corners * (1 + reach / 2)) + 0.3 * np.sign(np.sin(6 * np.pi * corners + reach))
    voltage = Profile(np.tile(corners, (RUNS, 1)), reach * waves)
    lag, gain = (value * np.exp(0.05 * rng.standard_normal(RUNS)) for value in (0.03, 0.1))
    position = simulate(declare(LIMIT), time, {"voltage": voltage}, {"lag": lag, "gain": gain}, fine=32)["position"]
    runs = Runs(time, {"position": position + NOISE * rng.standard_normal(position.shape)}, {"voltage": voltage},
                order=np.arange(float(RUNS)))
    fitted, = identify(prepare(declare(), runs)).fits
    kind = find_kind(fitted, PAIR)
    assert kind is not None
    return kind


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "step"), [(4, 0.04), (9, 0.01)])
def test_slope_and_limit_of_a_dead_band_are_within_their_errors(seed: int, step: float) -> None:
    kind = find(seed, step)
    assert (kind.pair, kind.name) == (PAIR, "saturation")
    for coefficient, truth in zip(kind.coefficients, (SLOPE, LIMIT), strict=True):
        error = (coefficient.upper - coefficient.lower) / 3.92
        assert abs(coefficient.value - truth) < 2 * error < 0.25 * abs(truth), coefficient
