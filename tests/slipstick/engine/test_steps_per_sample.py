"""Steps per sample, beside what the fits that they are for can tell."""

import numpy as np
import pytest

from slipstick.engine import preparation
from slipstick.engine.fit import fit
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.engine.simulation import simulate_runs
from slipstick.machine import Block, Command, Machine, Parameter, Quantity, Sensor, list_experiments


def declare_motor() -> Machine:
    """A motor whose winding, with an inductance that all runs share, has a third of a sample as its time constant."""
    motor = Block("motor", gives="speed", reads=("voltage",), states=("speed", "current"), parameters=(
        Parameter("resistance", "ohm", value=1.2, scatter=0.05),
        Parameter("inductance", "H", value=2e-3, within=0.3, scatter=0.0),
        Parameter("inertia", "kg m^2", value=3e-4, scatter=0.05)),
        quantities=(Quantity("lost torque", "N m", size=0.01),))

    @motor.rate
    def turn(x, u, q, p):  # type: ignore[no-untyped-def]
        current = (u.voltage - p.resistance * x.current - 0.05 * x.speed) / p.inductance
        return (0.05 * x.current - 2e-4 * x.speed - q.lost_torque) / p.inertia, current

    voltages = ((0, 2), (0.12, 20), (0.31, 5), (0.47, -10), (0.62, 15)), ((0, -4), (0.24, 22), (0.4, 8), (0.7, -9))
    return Machine("motor", (motor,), (Sensor("speed", "rad/s", noise=0.1),),
                   commands=(Command("voltage", "V", profiles=voltages),), duration=0.8, step=0.005)


def test_steps_move_no_shared_value_by_much_of_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = declare_motor()
    runs = simulate_runs(machine, list_experiments(machine).take(np.arange(30) % 2), seed=2, fine=32)

    def estimate(recorded: Recorded) -> tuple[float, float]:
        fitted, place = fit(recorded, {}, {}).fitted, len(recorded.random)
        return fitted.coefficients[place], np.sqrt(fitted.covariance[place, place])

    chosen = prepare(machine, runs)
    monkeypatch.setattr(preparation, "_EXACT", 1e-6)
    exact = prepare(machine, runs)
    assert exact.parts[0].fine > chosen.parts[0].fine
    (value, error), (right, _) = estimate(chosen), estimate(exact)
    assert value == pytest.approx(right, abs=0.25 * error)
