"""Blocks that read each other's signals are studied as one where samples hide what these do."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.engine.measured_law import Law
from slipstick.engine.preparation import prepare
from slipstick.engine.selection import identify
from slipstick.engine.simulation import simulate_runs
from slipstick.machine import Machine, Runs, list_experiments
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


@pytest.mark.parametrize(("machine", "step", "names"), [
    (MOTOR, 2.5e-4, ["winding", "shaft"]), (MOTOR, 2e-3, ["winding and shaft"]), (MOTOR, 8e-3, ["winding and shaft"]),
    (PLATE, 8.0, ["fan", "plate"])])
def test_blocks_are_joined_that_read_each_other_where_samples_hide_what_signals_do(machine: Machine, step: float,
                                                                                   names: list[str]) -> None:
    assert [part.name for part in prepare(*sample(machine, step, 1)).parts] == names


def test_blocks_stay_apart_that_cannot_be_joined_or_do_not_explain_their_signal() -> None:
    machine, runs = sample(MOTOR, 8e-3, 1)
    winding, shaft = machine.blocks
    same = replace(winding, states=("speed",), rate_function=lambda x, u, q, p: -x.speed)
    for block in (same, replace(winding, window=lambda u: u.time > 0.1)):
        prepared = prepare(replace(machine, blocks=(block, shaft)), runs)
        assert [part.name for part in prepared.parts] == ["winding", "shaft"]
    other = prepare(machine, runs, {"resistance value": 100.0})  # the simulation hardly moves
    assert [part.name for part in other.parts] == ["winding", "shaft"]


@pytest.mark.parametrize("seed", [1, 2])
def test_coarse_samples_alone_name_nothing(seed: int) -> None:
    """The current settles within 3 ms: a lag was named of blocks that read samples, a voltage with 8 steps in each."""
    answer = identify(prepare(*sample(MOTOR, 16e-3, seed)))
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
    blocks = next(section for section in sections(result, []) if section.title == "Blocks")
    assert any("The blocks “winding” and “shaft” read each other's signals" in part.text for part in blocks.parts
               if isinstance(part, Note))
