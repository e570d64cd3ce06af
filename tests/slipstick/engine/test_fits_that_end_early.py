"""Fits of candidates end where a step promises little beside what is missing."""

import numpy as np

from slipstick.engine.laws import list_candidates
from slipstick.engine.preparation import prepare
from slipstick.engine.priors import Prior
from slipstick.engine.settling import fit_bare
from slipstick.engine.simulation import simulate_runs
from slipstick.machine import Block, Command, Condition, Machine, Parameter, Quantity, Sensor, list_experiments


def declare_rotor(strength: float) -> Machine:
    """A rotor with an eddy-current brake behind a resistor."""
    rotor = Block("rotor", gives="speed", reads=("torque", "resistance"), states=("speed",), parameters=(
        Parameter("inertia", "kg m^2", value=0.02), Parameter("viscous", "N m s", value=0.01, scatter=0.1)),
        quantities=(Quantity("drag", "N m s", size=0.02, over=("resistance",)),))

    @rotor.rate
    def turn(x, u, q, p):  # type: ignore[no-untyped-def]
        return (u.torque - (p.viscous + q.drag + strength / p.resistance) * x.speed) / p.inertia

    torques = ((0, 0), (0.1, 1), (1, 1), (1.2, 0.4), (2, 0.4)), ((0, 0.5), (0.5, 1.5), (1, 0.2), (2, 1))
    return Machine("rotor", (rotor,), (Sensor("speed", "rad/s", noise=0.2),),
                   commands=(Command("torque", "N m", profiles=torques),), duration=2.0, step=0.01,
                   conditions=(Condition("resistance", "ohm", levels=(1, 2, 3, 5, 8, 12), within=0.01, scatter=0.01),))


def test_what_a_step_promises_is_believed_as_far_as_the_last_columns_have_gained() -> None:
    true = declare_rotor(0.1)
    experiments = list_experiments(true)
    runs = simulate_runs(true, experiments.take(np.tile(np.arange(len(experiments)), 2)), seed=1)
    bare = fit_bare(prepare(declare_rotor(0.0), runs))
    [law] = [each for each in list_candidates(bare.recorded, {name: model.own() for name, model in bare.models.items()})
             if each.pair == ("drag", "resistance")]
    whole, early = (bare.beside({law.pair: law}, {law.pair: Prior(1.0, 0.3)}, None, settled)
                    for settled in (0.0, 270.0))
    assert whole.converged
    assert early.evidence > whole.evidence - 27  # 200 nats short where the promise is believed
