"""Machines as data for other programs: declared ones, those of other simulators, and both under a name."""

import dataclasses
from pathlib import Path

import pytest

from slipstick.black_box import BlackBox
from slipstick.black_box.known import KnownMachine, list_known
from slipstick.errors import InvalidValue
from slipstick.machine import open_machine

ROOT = Path(__file__).parents[3]
MOTOR = ROOT / "docs" / "motor.toml"


def test_a_declared_machine_has_its_declaration_and_outputs() -> None:
    known, = list_known([open_machine("dc_motor")], BlackBox.open_all("dc_motor"))
    assert known.name == "dc motor"
    assert known.declared is not None
    assert [(each.about.output.name, each.conditions) for each in known.outputs] == [
        ("run_up_time", 9), ("largest_current", 9)]
    assert KnownMachine.from_json(known.to_json()) == known


def test_another_machine_has_outputs_alone() -> None:
    file = BlackBox.open(MOTOR)
    known, = list_known([], [file])
    assert (known.declared, known.name) == (None, file.description.title)
    assert known.outputs[0].about == file.description
    assert KnownMachine.from_json(known.to_json()) == known


def test_a_machine_that_is_not_simulated_has_no_outputs() -> None:
    machine = dataclasses.replace(open_machine("dc_motor"), outputs=())
    known, = list_known([machine], [])
    assert (known.name, known.outputs) == ("dc motor", ())


@pytest.mark.parametrize("name", ["", "a\nb", "x" * 201, "\x00"])
def test_names_that_are_no_line_are_refused(name: str) -> None:
    with pytest.raises(InvalidValue, match="name of a machine"):
        KnownMachine(name, None, ()).to_json()
