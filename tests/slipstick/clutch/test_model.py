"""Spec, digest and validation of a model."""

import json
from collections.abc import Callable
from typing import Any

import pytest

from slipstick.bench import parameters
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, UnknownName
from tests.benches import COMPACT, HEAVY, NOMINAL


def test_spec_survives_json_and_keeps_the_digest() -> None:
    model = NOMINAL.with_parameters({"pressure_bias": 1.7}).with_effect("stribeck_friction", {"strength": 0.1})
    restored = Model.from_spec(json.loads(json.dumps(model.spec())))
    assert restored == model
    assert restored.digest == model.digest != NOMINAL.digest


@pytest.mark.parametrize("damage", [
    lambda bench: bench["torque_converter"]["torque_ratio"].__setitem__(0, 2.0),
    lambda bench: bench["parameters"].update(gear_ratio=3.1), lambda bench: bench.update(torque_converter=None),
    lambda bench: bench.update(digest=COMPACT.digest)])
def test_a_bench_that_does_not_match_its_digest_is_rejected(damage: Callable[[dict[str, Any]], None]) -> None:
    spec = json.loads(json.dumps(NOMINAL.spec()))
    assert Model.from_spec(spec) == NOMINAL
    damage(spec["bench"])
    with pytest.raises(InvalidValue, match="its digest does not match"):
        Model.from_spec(spec)


def test_models_of_different_benches_differ() -> None:
    same = Model(COMPACT.physics).with_parameters(dict(zip(parameters.NAMES, NOMINAL.parameters, strict=True)))
    assert same.parameters == NOMINAL.parameters
    assert same.digest != NOMINAL.digest
    with pytest.raises(InvalidValue, match="made for another bench than 'heavy'"):
        HEAVY.require(same.physics)
    HEAVY.require(NOMINAL.physics)


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
