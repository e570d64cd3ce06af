"""Blocks between which a signal does more than its samples show are studied as one."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.engine.measured_law import Law
from slipstick.engine.preparation import prepare
from slipstick.engine.selection import identify
from slipstick.engine.simulation import simulate_runs
from slipstick.machine import Block, Machine, Runs, list_experiments
from slipstick.machine_studies import study_machine
from slipstick.plausibility.machine import inspect_machine
from slipstick.report.machine_study import warnings

MOTOR, PLATE = Machine.open("dc_motor"), Machine.open("heated_plate")
WEAR = Law(("viscous friction", "time"), "curve", "", "s", np.array([0.0, 1.0]), np.array([0.0, 1.0]), np.zeros((2, 2)),
           0)


def sample(machine: Machine, step: float, seed: int, *laws: Law) -> tuple[Machine, Runs]:
    """Return a machine with samples a `step` in s apart, and 24 runs of it that are simulated as finely as before."""
    coarse = replace(machine, step=step)
    experiments = list_experiments(coarse)
    taken = experiments.take(np.arange(24) % len(experiments))
    return coarse, simulate_runs(coarse, taken, seed=seed, laws=laws, fine=4 * round(step / machine.step))


@pytest.mark.parametrize(("machine", "step", "names"), [
    (MOTOR, 2e-3, ["winding", "shaft"]), (MOTOR, 8e-3, ["winding and shaft"]),
    (PLATE, 2.0, ["fan", "plate"]), (PLATE, 8.0, ["fan and plate"])])
def test_blocks_are_joined_where_samples_hide_what_a_signal_does(machine: Machine, step: float,
                                                                 names: list[str]) -> None:
    assert [part.name for part in prepare(*sample(machine, step, 1)).parts] == names


def test_blocks_stay_apart_that_cannot_be_joined_or_do_not_explain_their_signal() -> None:
    machine, runs = sample(PLATE, 8.0, 1)
    fan, plate = machine.blocks
    same = Block("fan", "air speed", fan.reads, ("temperature",), fan.parameters, fan.quantities)
    same.rate(lambda x, u, q, p: (p.radiator_gain * u.fan_voltage - x.temperature) / p.fan_lag)
    for block in (same, replace(fan, window=lambda u: u.time > 60)):
        assert [part.name for part in prepare(replace(machine, blocks=(block, plate)), runs).parts] == ["fan", "plate"]


def test_coarse_samples_alone_name_nothing() -> None:
    """The current settles within 3 ms. Of blocks that read samples of it and of the speed, a lag was named."""
    answer = identify(prepare(*sample(MOTOR, 16e-3, 1)))
    assert not answer.findings
    assert not answer.unexplained


def test_a_study_of_coarse_samples_names_the_law_and_tells_that_blocks_are_joined() -> None:
    machine, runs = sample(MOTOR, 8e-3, 5, WEAR)
    runs = runs.take(np.arange(12))
    result, _ = study_machine(machine, runs)
    assert [(finding.quantity, finding.depends_on) for finding in result.findings] == [WEAR.pair]
    assert result.findings[0].confirmed
    block, = result.blocks
    assert (block.name, block.joined, block.unexplained) == ("winding and shaft", ["winding", "shaft"], False)
    assert "Studied as one: blocks “winding” and “shaft”." in dict(
        entry for entry in warnings(result) if isinstance(entry, tuple))


def test_the_check_of_a_machine_tells_that_its_step_is_too_long() -> None:
    about = {step: [finding.key for finding in inspect_machine(replace(MOTOR, step=step)).findings]
             for step in (2e-3, 8e-3)}
    assert "winding and shaft" in about[8e-3]
    assert "winding and shaft" not in about[2e-3]
