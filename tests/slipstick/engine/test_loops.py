"""Blocks that read each other's signals are simulated together, and apart where that does not explain them."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.engine.loops import join_loops
from slipstick.engine.measured_law import Law
from slipstick.engine.simulation import simulate, simulate_runs
from slipstick.engine.study import fit_parameters, identify_runs
from slipstick.machine import Command, Machine, Profile, Runs, list_experiments
from slipstick.machine_studies import study_machine
from slipstick.report.machine_study import sections
from slipstick.report.study.parts import Note

MOTOR, PLATE = Machine.open("dc_motor"), Machine.open("heated_plate")
WEAR = Law(("viscous friction", "time"), "curve", "", "s", np.array([0.0, 1.0]), np.array([0.0, 1.0]), np.zeros((2, 2)),
           0)


def sample(machine: Machine, step: float, seed: int, *laws: Law) -> tuple[Machine, Runs]:
    """Return a machine with samples a `step` in s apart, and 24 runs of it, simulated with fine steps."""
    coarse = replace(machine, step=step)
    experiments = list_experiments(coarse)
    taken = experiments.take(np.arange(24) % len(experiments))
    return coarse, simulate_runs(coarse, taken, seed=seed, laws=laws, fine=max(4, 4 * round(step / machine.step)))


def names(machine: Machine) -> list[str]:
    return [block.name for block in machine.blocks]


def test_blocks_in_a_loop_are_one_and_those_of_a_chain_are_not() -> None:
    assert names(join_loops(*sample(MOTOR, 2e-3, 1))) == ["winding and shaft"]
    assert names(join_loops(*sample(PLATE, 2.0, 1))) == ["fan", "plate"]


def test_blocks_stay_apart_that_cannot_be_joined_or_do_not_explain_their_signal() -> None:
    machine, runs = sample(MOTOR, 8e-3, 1)
    winding, shaft = machine.blocks
    same = replace(winding, states=("speed",), rate_function=lambda x, u, q, p: -x.speed)
    for block in (same, replace(winding, window=lambda u: u.time > 0.1)):
        assert names(join_loops(replace(machine, blocks=(block, shaft)), runs)) == ["winding", "shaft"]
    assert names(join_loops(machine, runs, {"resistance value": 100.0})) == ["winding", "shaft"]  # it hardly moves
    for less in (replace(runs, signals={"current": runs.signals["current"]}), replace(runs, conditions={})):
        assert names(join_loops(machine, less)) == ["winding", "shaft"]


@pytest.mark.slow
def test_coarse_samples_alone_name_nothing() -> None:
    """The current settles within 3 ms: a lag was named of blocks that read samples, a voltage with 8 steps in each."""
    answer = identify_runs(*sample(MOTOR, 16e-3, 1))
    assert not answer.findings
    assert not answer.unexplained


def test_a_study_of_a_loop_names_the_law_and_tells_that_blocks_are_joined() -> None:
    machine, runs = sample(MOTOR, 16e-3, 5, WEAR)
    runs = runs.take(np.arange(8))
    result, _ = study_machine(machine, runs)
    assert [(finding.quantity, finding.depends_on) for finding in result.findings] == [WEAR.pair]
    assert result.findings[0].confirmed
    block, = result.blocks
    assert (block.name, block.joined, block.unexplained) == ("winding and shaft", ["winding", "shaft"], False)
    blocks = next(section for section in sections(result, []) if section.title == "Blocks")
    assert any("The blocks “winding” and “shaft” read each other's signals" in part.text for part in blocks.parts
               if isinstance(part, Note))


def disturb(machine: Machine, runs: Runs, size: float) -> Runs:
    """Return runs of a motor whose shaft is pushed by torques of a `size` in N m that are not recorded."""
    winding, shaft = machine.blocks
    rng, turn, corners = np.random.default_rng(6), shaft.rate_function, np.linspace(0, 1, 51)
    assert turn is not None

    def turn_pushed(x, u, q, p):  # type: ignore[no-untyped-def]
        acceleration, speed = turn(x, u, q, p)
        return acceleration - u.push / p.rotor_inertia, speed

    pushed = replace(machine, commands=(*machine.commands, Command("push")), blocks=(
        winding, replace(shaft, reads=(*shaft.reads, "push"), rate_function=turn_pushed)))
    push = Profile(np.tile(corners, (len(runs), 1)), size * rng.standard_normal((len(runs), len(corners))))
    signals = simulate(pushed, runs.time, {**runs.commands, "push": push}, runs.conditions)
    return replace(runs, signals={sensor.signal: signals[sensor.signal] + sensor.noise * rng.standard_normal(
        (len(runs), len(runs.time))) for sensor in machine.sensors})


@pytest.mark.slow
def test_blocks_of_a_disturbed_machine_are_studied_apart_and_one_is_unexplained() -> None:
    """A torque that fluctuates reaches all signals of a simulation, and those of the shaft alone where it is driven."""
    machine, runs = sample(MOTOR, 4e-3, 3)
    runs = disturb(machine, runs.take(np.arange(12)), 4e-3)
    answer = identify_runs(machine, runs)
    assert [part.name for fit in answer.fits for part in fit.recorded.parts] == ["winding", "shaft"]
    assert answer.unexplained == ("shaft",)
    assert not answer.findings
    assert [part.name for part in fit_parameters(machine, runs).recorded.parts] == ["winding", "shaft"]
