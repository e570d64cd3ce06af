"""Conditions whose stated values are off by more than a machine declares are said beside the parameters."""

import numpy as np
import pytest

import slipstick
from slipstick.engine.simulation import simulate
from slipstick.interface.machine_study import MachineCalibration
from slipstick.machine import Block, Command, Condition, Machine, Parameter, Profile, Runs, Sensor
from slipstick.report.machine_study import advise
from slipstick.report.study.parts import Items

RUNS, TIME, LOADS = 24, np.linspace(0, 4, 81), (1.0, 2.0, 3.0)


def declare() -> Machine:
    """A wheel that a force drives against a load."""
    wheel = Block("wheel", gives="speed", reads=("force", "load"), states=("speed",),
                  parameters=(Parameter("mass", "kg", value=2.0), Parameter("loss", "kg/s", value=1.5)))
    wheel.rate(lambda x, u, q, p: (u.force - p.load - p.loss * x.speed) / p.mass)
    return Machine("wheel", (wheel,), (Sensor("speed", "m/s"),), (Command("force", "N"),),
                   (Condition("load", "N", levels=LOADS),))


def record(factors: dict[float, float], scatter: float) -> Runs:
    """Runs whose loads are those stated times a factor of the level, with a scatter."""
    rng, machine, stated = np.random.default_rng(3), declare(), np.tile(LOADS, RUNS // len(LOADS))
    loads = stated * [factors.get(load, 1.0) for load in stated] * np.exp(scatter * rng.standard_normal(RUNS))
    force = Profile(np.tile([0.0, 1, 2, 4], (RUNS, 1)), rng.uniform(4, 12, (RUNS, 4)))
    values = {"load": loads, **{name: value * np.exp(0.02 * rng.standard_normal(RUNS))
                                for name, value in (("mass", 2.0), ("loss", 1.5))}}
    speed = simulate(machine, TIME, {"force": force}, values)["speed"]
    return Runs(TIME, {"speed": speed + 0.02 * rng.standard_normal(speed.shape)}, {"force": force}, {"load": stated},
                order=np.arange(float(RUNS)))


@pytest.mark.parametrize(("factors", "scatter", "error", "scatters"), [
    ({3.0: 1.2}, 0.02, (0.03, 0.061), (0.0, 0.15)), ({}, 0.12, (-0.06, 0.06), (0.08, 0.15))], ids=["level", "runs"])
def test_a_condition_is_said_that_is_off_at_a_level_or_from_run_to_run(
        factors: dict[float, float], scatter: float, error: tuple[float, float], scatters: tuple[float, float]) -> None:
    """An error of a level is at most three times what is declared, and the scatter as well."""
    study = slipstick.study(declare(), record(factors, scatter), progress=False)
    off, = study.result.conditions
    assert off.name == "load"
    assert error[0] <= off.error <= error[1]
    assert scatters[0] <= off.scatter <= scatters[1]
    assert study.summary()[-1].startswith("Stated conditions outside of what is declared: load, ")
    advice = [entry for part in advise(study.result).parts if isinstance(part, Items) for entry in part.entries]
    assert [text.partition(":")[0] for lead, text in advice if lead == "Next experiment:"] == [
        "measure the load in each run"]
    fitted = slipstick.calibrate(declare(), record(factors, scatter), progress=False)
    assert [each.name for each in fitted.conditions] == ["load"]
    assert "Stated conditions outside of what is declared: load, " in fitted.summary()[-1]
    assert MachineCalibration.from_dict(fitted.to_dict()).conditions == fitted.conditions


def test_conditions_within_what_is_declared_are_not_said() -> None:
    fitted = slipstick.calibrate(declare(), record({3.0: 1.02}, 0.03), progress=False)
    assert fitted.conditions == []
