"""Spec, digest and validation of a model."""

import json

import pytest

from slipstick.bench import parameters
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, UnknownName
from tests.benches import HEAVY, NOMINAL


def test_spec_survives_json_and_keeps_the_digest() -> None:
    model = NOMINAL.with_parameters({"pressure_bias": 1.7}).with_effect("stribeck_friction", {"strength": 0.1})
    restored = Model.from_spec(json.loads(json.dumps(model.spec())))
    assert restored == model
    assert restored.digest == model.digest != NOMINAL.digest


def test_other_converter_curves_are_rejected() -> None:
    spec = NOMINAL.spec()
    spec["torque_converter"] = {**spec["torque_converter"], "torque_ratio": [2.0] * 13}
    with pytest.raises(InvalidValue, match="other torque converter curves"):
        Model.from_spec(spec)


@pytest.mark.parametrize("coefficients", [{}, {"strength": 0.1}])
def test_unknown_effects_are_rejected(coefficients: dict[str, float]) -> None:
    with pytest.raises(UnknownName, match="Did you mean 'stribeck_friction'"):
        Model(HEAVY.physics, effects={"stribek_friction": coefficients})


def test_values_that_are_not_finite_are_rejected() -> None:
    with pytest.raises(InvalidValue, match="not finite"):
        NOMINAL.with_parameters({"pressure_bias": float("nan")})


def test_every_parameter_is_described() -> None:
    assert len(parameters.PARAMETERS) == 20
    assert len(parameters.UNCERTAIN) == 7
    assert all(entry.unit and entry.symbol and entry.meaning for entry in parameters.PARAMETERS)
