"""Models: spec, digest and validation; and their conditions: run order and reversals of current."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipstick.bench import parameters
from slipstick.bench.conditions import reversals
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


# Run order of conditions, and reversals of their current profiles.


PAPER = HEAVY.conditions


def test_the_run_order_is_kept_but_does_not_enter_the_digest() -> None:
    ordered = replace(PAPER, run_order=np.arange(216)[::-1])
    assert ordered.digest == PAPER.digest
    selected = ordered.take([3, 215])
    assert selected.run_order is not None
    assert selected.run_order.tolist() == [212, 0]
    assert PAPER.take([3]).run_order is None
    with_order, without_order = (len(entry.columns(with_run_order=True)) for entry in (ordered, PAPER))
    assert with_order == without_order + 1 == len(ordered.columns()) + 1


@pytest.mark.parametrize("order", [np.arange(215), np.full(216, 0.5), np.full(216, np.nan)])
def test_invalid_run_orders_are_rejected(order: np.ndarray) -> None:
    with pytest.raises(InvalidValue, match="run order is not one whole number per condition"):
        replace(PAPER, run_order=order)


def test_reversals_of_a_current() -> None:
    current = np.array([0.1, 0.7, 0.7, 0.3, 0.3, 0.5, 0.2])
    directions, reversal_currents, swings = reversals(current).T
    assert directions.tolist() == [1, 1, -1, -1, 1, -1, -1]
    assert reversal_currents.tolist() == [0.1, 0.1, 0.7, 0.7, 0.3, 0.5, 0.5]
    np.testing.assert_allclose(swings, [0, 0, 0.6, 0.6, 0.4, 0.2, 0.2])
    assert reversals(np.array([0.4, 0.4])).tolist() == [[1, 0.4, 0], [1, 0.4, 0]]
    assert reversals(np.array([0.4, 0.2]))[:, 0].tolist() == [-1, -1]
