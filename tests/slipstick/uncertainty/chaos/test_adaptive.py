"""The error estimate of an expansion, compared with the true error on the simulator, and the adaptive order."""

from collections.abc import Callable

import numpy as np
import pytest

from slipstick.clutch.ensemble import Simulator
from slipstick.errors import InvalidValue
from slipstick.uncertainty import standard_normals
from slipstick.uncertainty.chaos import (
    Expansion,
    ExpansionSettings,
    Germ,
    adapt,
    expand,
    germs_from_normals,
    make_basis,
)
from tests.benches import HEAVY, NOMINAL

AXES = ("pressure_bias", "initial_position", "friction_coefficient", "current_gain", "current_delay")
CONDITIONS = HEAVY.conditions.take(range(0, 216, 5))
OfGerms = Callable[[np.ndarray], np.ndarray]


def clutch(dimension: int, std: float) -> OfGerms:
    simulator = Simulator(NOMINAL, AXES[:dimension])
    return lambda germs: simulator(1 + std * germs, CONDITIONS)


def smooth(germs: np.ndarray) -> np.ndarray:
    x = germs.mean(axis=1) + 0.3 * germs[:, 0]
    return np.column_stack([np.exp(0.5 * x), np.sin(x), 1 / (4 + x**2), np.exp(-0.2 * x) * germs[:, -1]])


def true_error(expansion: Expansion, model: OfGerms, samples: int = 1024) -> np.ndarray:
    germs = expansion.basis.germs
    held_out = germs_from_normals(germs, standard_normals(len(germs), samples, 99))
    error: np.ndarray = np.sqrt(np.mean((expansion.at(held_out) - model(held_out)) ** 2, axis=0))
    return error


@pytest.mark.parametrize(("family", "dimension", "settings"), [
    (Germ("hermite"), 1, ExpansionSettings(4)), (Germ("hermite"), 2, ExpansionSettings(8)),
    (Germ("hermite"), 5, ExpansionSettings(4, 0.75)), (Germ("laguerre", (100.0,)), 2, ExpansionSettings(4)),
    (Germ("laguerre", (100.0,)), 3, ExpansionSettings(3)), (Germ("legendre"), 3, ExpansionSettings(3, rule="tensor")),
    (Germ("legendre"), 2, ExpansionSettings(6, rule="regression")), (Germ("legendre"), 5, ExpansionSettings(2))])
def test_the_error_estimate_is_close_to_the_true_error(family: Germ, dimension: int,
                                                       settings: ExpansionSettings) -> None:
    basis = make_basis((family,) * dimension, settings)
    # The error of a smooth function is concentrated in the tails, and the true error needs more samples.
    for model, samples in ((clutch(dimension, 0.08), 1024), (smooth, 2**16)):
        expansion = expand(basis, model(basis.nodes))
        low, median, high = np.quantile(expansion.error / true_error(expansion, model, samples), [0.1, 0.5, 0.9])
        assert 0.5 < median < 2
        assert low > 0.25
        assert high < 4


@pytest.mark.parametrize("norm", [1.0, 0.75])
@pytest.mark.parametrize(("dimension", "tolerance"), [(2, 1e-3), (3, 3e-3)])
def test_the_order_rises_until_the_error_is_small_enough(dimension: int, tolerance: float, norm: float) -> None:
    model, germs = clutch(dimension, 0.1), (Germ("hermite"),) * dimension
    adapted = adapt(model, germs, tolerance, 3000, ExpansionSettings(norm=norm))
    assert adapted.reached
    assert adapted.error <= tolerance
    assert true_error(adapted.expansion, model).max() < 2 * tolerance
    relaxed = adapt(model, germs, 10 * tolerance, 3000, ExpansionSettings(norm=norm))
    assert relaxed.expansion.basis.order < adapted.expansion.basis.order
    assert relaxed.runs < adapted.runs


def test_runs_are_counted_and_limited() -> None:
    calls: list[int] = []

    def model(germs: np.ndarray) -> np.ndarray:
        calls.append(len(germs))
        return np.abs(germs[:, :1] - 0.1)

    adapted = adapt(model, (Germ("hermite"),) * 3, 1e-9, 200)
    assert not adapted.reached
    assert adapted.error > 1e-9
    assert adapted.runs == sum(calls) <= 200
    assert len(calls) > 2


def test_an_expansion_of_all_conditions_is_preferred_to_a_smaller_error() -> None:
    def model(germs: np.ndarray) -> np.ndarray:
        with np.errstate(invalid="ignore"):
            return np.column_stack([germs[:, 0], np.sqrt(2.5 - germs[:, 0])])

    adapted = adapt(model, (Germ("hermite"),), 1e-6, 400)
    assert not adapted.expansion.missing.any()
    assert not adapted.reached


def test_a_fixed_number_of_nodes_bounds_the_order() -> None:
    adapted = adapt(lambda germs: np.abs(germs[:, :1]), (Germ("hermite"),), 1e-9, 1000, ExpansionSettings(1, nodes=6))
    assert not adapted.reached
    assert adapted.expansion.basis.order <= 5


def test_too_few_runs_and_no_checks_raise() -> None:
    with pytest.raises(InvalidValue, match="3 runs do not suffice"):
        adapt(smooth, (Germ("hermite"),) * 4, 0.1, 3)
    with pytest.raises(InvalidValue, match="checks"):
        adapt(smooth, (Germ("hermite"),), 0.1, 100, ExpansionSettings(checks=0))
