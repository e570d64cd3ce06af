"""Machines as data for other programs: declared ones, those of other simulators, and both under a name."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipstick.black_box import BlackBox
from slipstick.black_box.known import KnownMachine, list_known
from slipstick.black_box.ranges import simulate_ranges
from slipstick.engine.simulation import simulate_runs
from slipstick.errors import InvalidValue
from slipstick.machine import (
    Block,
    Command,
    Machine,
    Sensor,
    SignalRange,
    describe_machine,
    list_experiments,
    open_machine,
)

ROOT = Path(__file__).parents[3]
MOTOR = ROOT / "docs" / "motor.toml"


def test_a_declared_machine_has_its_declaration_and_outputs() -> None:
    known, = list_known([open_machine("dc_motor")], BlackBox.open_all("dc_motor"))
    assert known.name == "dc motor"
    assert known.declared is not None
    assert [(each.about.output.name, each.conditions) for each in known.outputs] == [
        ("run_up_time", 9), ("largest_current", 9)]
    assert KnownMachine.from_json(known.to_json()) == known


def test_ranges_of_signals_are_those_of_the_experiments() -> None:
    motor = open_machine("dc_motor")
    signals = simulate_runs(motor, list_experiments(motor)).signals
    assert {each.signal: (each.lowest, each.highest) for each in simulate_ranges(motor)} == {
        name: (values.min(), values.max()) for name, values in signals.items()}
    assert list_known([motor], [])[0].declared == describe_machine(motor, simulate_ranges(motor))


def test_without_experiments_or_where_they_fail_there_are_no_ranges(monkeypatch: pytest.MonkeyPatch) -> None:
    def machine(output: Callable[..., Any], duration: float = 1.0) -> Machine:
        block = Block("rotor", gives="speed", reads=("voltage",), output_function=output)
        return Machine("rotor", (block,), (Sensor("speed", "rad/s"),),
                       (Command("voltage", "V", (((0.0, 0.0), (1.0, 12.0)),)),), duration=duration, step=0.1)

    def endless(x: Any, u: Any, q: Any, p: Any) -> Any:
        while True:
            pass

    assert simulate_ranges(machine(lambda x, u, q, p: 2 * u.voltage)) == (SignalRange("speed", 0.0, 24.0),)
    assert simulate_ranges(machine(lambda x, u, q, p: 2 * u.voltage, duration=0.0)) == ()
    assert simulate_ranges(machine(lambda x, u, q, p: u.nothing)) == ()
    assert simulate_ranges(machine(lambda x, u, q, p: np.log(u.voltage - 1))) == ()
    monkeypatch.setattr("slipstick.black_box.ranges._SECONDS", 0.2)
    assert simulate_ranges(machine(endless)) == ()


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
