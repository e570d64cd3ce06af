"""Multiples as physical values: those of the axis or of the model, which need not be those of the bench."""

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, UnknownName
from slipstick.physical_values import PhysicalInput, physical_inputs
from slipstick.table import Axis, ForeignModel, Grid
from tests.benches import HEAVY, NOMINAL


def table(model: Model | ForeignModel) -> Grid:
    axes = (Axis("pressure_bias", np.array([0.5, 1.5]), 2.0, "bar"),)
    return Grid(axes, np.ones((2, 1)), np.zeros((2, 1), np.uint8), HEAVY.conditions.take([0]), model)


def test_multiples_are_of_the_axis_or_of_the_model() -> None:
    made = table(NOMINAL.with_parameters({"pressure_bias": 2.0}))
    assert physical_inputs(made, ("initial_position", "pressure_bias"), (1.2, 0.5), (0.1, 0.25)) == [
        PhysicalInput("initial_position", "m", 5e-4, pytest.approx(6e-4), pytest.approx(5e-5)),
        PhysicalInput("pressure_bias", "bar", 2.0, 1.0, 0.5)]


def test_an_unknown_input_is_refused() -> None:
    with pytest.raises(UnknownName):
        physical_inputs(table(NOMINAL), ("pressure",), (1.0,), (0.1,))
    with pytest.raises(InvalidValue, match="another program"):
        physical_inputs(table(ForeignModel("{}")), ("initial_position",), (1.0,), (0.1,))
