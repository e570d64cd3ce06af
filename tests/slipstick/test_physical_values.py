"""Multiples as physical values: those of the model or machine, which need not be those of the bench."""

import pytest

from slipstick.errors import UnknownName
from slipstick.machine import Input, Machine, Quantity
from slipstick.physical_values import PhysicalInput, physical_inputs
from tests.benches import NOMINAL

MOTOR = Machine("motor", (Input("resistance", "ohm", 1.2, 0.5, 1.5),), (Quantity("voltage", "V"),),
                Quantity("run_up_time", "s"), "")


def test_multiples_are_of_the_model_or_of_the_machine() -> None:
    assert physical_inputs(MOTOR, ("resistance",), (0.5,), (0.25,)) == [
        PhysicalInput("resistance", "ohm", 1.2, 0.6, pytest.approx(0.3))]
    made = NOMINAL.with_parameters({"pressure_bias": 2.0})
    assert physical_inputs(made, ("initial_position", "pressure_bias"), (1.2, 0.5), (0.1, 0.25)) == [
        PhysicalInput("initial_position", "m", 5e-4, pytest.approx(6e-4), pytest.approx(5e-5)),
        PhysicalInput("pressure_bias", "bar", 2.0, 1.0, 0.5)]


def test_an_unknown_input_is_refused() -> None:
    with pytest.raises(UnknownName):
        physical_inputs(NOMINAL, ("pressure",), (1.0,), (0.1,))
    with pytest.raises(UnknownName):
        physical_inputs(MOTOR, ("initial_position",), (1.0,), (0.1,))
