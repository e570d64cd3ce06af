"""The compact bench against converged results of the independent implementation (data/compact)."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.bench.parameters import NAMES
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.recordings import open_conditions
from tests.benches import COMPACT, HEAVY

DATA = Path(__file__).parent / "data"
AXES = ("pressure_bias", "initial_position")
POINTS = np.array([[1.0, 1.0], [0.8, 1.2], [1.2, 0.8]])


def reference(path: Path) -> np.ndarray:
    return np.loadtxt(path, delimiter=",", skiprows=1)[:, 1:].T


def error(model: Model, accuracy: ensemble.Accuracy) -> float:
    """Largest difference to the reference in s, over 90 conditions and 3 points."""
    times, status = ensemble.shifting_times(model, COMPACT.conditions, AXES, POINTS, accuracy)
    assert np.all(status == ensemble.LOCKED)
    return float(np.max(np.abs(times - reference(DATA / "compact" / "shifting_times.csv"))))


def test_the_conditions_are_those_of_the_reference() -> None:
    given = open_conditions(DATA / "compact" / "conditions.csv", COMPACT.profiles)
    assert len(given) == 90
    for mine, theirs in zip(COMPACT.conditions.columns(), given.columns(), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-9)


@pytest.mark.parametrize(("accuracy", "least"), [(ensemble.DEFAULT, 1e-4), (ensemble.TIGHT, 1e-5)],
                         ids=["default", "tight"])
def test_shifting_times_agree(accuracy: ensemble.Accuracy, least: float) -> None:
    assert error(Model(COMPACT.physics), accuracy) < least


@pytest.mark.parametrize("name", NAMES)
def test_a_wrong_parameter_does_not_agree(name: str) -> None:
    right = Model(COMPACT.physics)
    value = right.parameters[NAMES.index(name)]
    assert error(right.with_parameters({name: 1.01 * value}), ensemble.TIGHT) > 1e-5


@pytest.mark.parametrize("curve", ["torque_ratio", "capacity_factor"])
def test_a_wrong_converter_does_not_agree(curve: str) -> None:
    converter = COMPACT.physics.curves
    values = list(getattr(converter, curve))
    values[5] *= 1.01
    wrong = replace(COMPACT.physics, converter=replace(converter, **{curve: tuple(values)}))
    assert error(Model(wrong), ensemble.TIGHT) > 1e-5


def test_the_default_table_is_as_before() -> None:
    # Shifting times of the default table at these points, by the version that integrates eq. 1 exactly.
    points = np.array([[1, 1], [0.5, 0.5], [0.5, 1.5], [1.5, 0.5], [1.5, 1.5]])
    before = np.loadtxt(DATA / "default_accuracy.csv", delimiter=",", skiprows=1)[:, 1:].T
    times, _ = ensemble.shifting_times(Model(HEAVY.physics), HEAVY.conditions, AXES, points)
    assert np.max(np.abs(times - before)) < 1e-6


def test_two_benches_are_simulated_by_one_compiled_simulator() -> None:
    alone = {bench.name: ensemble.shifting_times(Model(bench.physics), bench.conditions)[0]
             for bench in (HEAVY, COMPACT)}
    again: dict[str, np.ndarray] = {}
    for bench in (COMPACT, HEAVY):
        assert isinstance(bench, Bench)
        again[bench.name] = ensemble.shifting_times(Model(bench.physics), bench.conditions)[0]
    for name, times in alone.items():
        np.testing.assert_array_equal(times, again[name])
