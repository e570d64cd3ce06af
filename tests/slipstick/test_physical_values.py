"""Multiples as physical values: those of the model, which need not be those of the bench."""

import pytest

from slipstick.errors import UnknownName
from slipstick.physical_values import PhysicalInput, physical_inputs
from tests.benches import NOMINAL


def test_multiples_are_of_the_model() -> None:
    model = NOMINAL.with_parameters({"pressure_bias": 2.0})
    assert physical_inputs(model, ("initial_position", "pressure_bias"), (1.2, 0.5), (0.1, 0.25)) == [
        PhysicalInput("initial_position", "m", 5e-4, pytest.approx(6e-4), pytest.approx(5e-5)),
        PhysicalInput("pressure_bias", "bar", 2.0, 1.0, 0.5)]


def test_an_unknown_input_is_refused() -> None:
    with pytest.raises(UnknownName):
        physical_inputs(NOMINAL, ("pressure",), (1.0,), (0.1,))
