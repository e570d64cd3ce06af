"""Slopes of the simulation are kept where they predict it, and nowhere else."""

from collections.abc import Callable

import numpy as np
import pytest

from slipstick.clutch.model import Model
from slipstick.confirmation import Terms, Traces, slopes
from slipstick.confirmation.fit import fit_simulation
from slipstick.confirmation.simulated import SimulatedBench
from slipstick.confirmation.slopes import Slopes
from tests.benches import HEAVY, NOMINAL

Traced = Callable[[Model], tuple[Traces, np.ndarray]]


def test_what_a_straight_line_does_not_predict_is_missed_and_only_that() -> None:
    x = np.array([[0.0], [0.0], [0.0]])
    known = Slopes(x, np.zeros((3, 1)), np.zeros((3, 2)), np.ones((3, 1, 2)), np.full((3, 1, 2), 2.0))
    predicted = np.array([[3.0, 3.0], [3.0, 3.3], [3.0, 3.3]])
    counted = np.array([[True, True], [True, True], [True, False]])
    np.testing.assert_array_equal(known.miss(x + 1, np.ones(1), predicted, counted), [False, True, False])
    other = Slopes(x[:1] + 1, np.ones((1, 1)), predicted[1:2], np.full((1, 1, 2), 5.0), np.zeros((1, 1, 2)))
    renewed = known.renewed(np.array([False, True, False]), other)
    np.testing.assert_array_equal(renewed.own[:, 0, 0], [1.0, 5.0, 1.0])
    assert not renewed.miss(renewed.points, np.ones(1), renewed.predicted, counted)[1]
    assert known.own[1, 0, 0] == 1.0  # as it was


@pytest.fixture(scope="module")
def truth() -> Model:
    return NOMINAL.with_effect("quadratic_load_drag", {"drag": 0.03})


def test_a_fit_is_the_same_with_fewer_simulations(traced: Traced, truth: Model,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    traces, points = traced(truth)
    simulated, respond = [0], SimulatedBench.respond

    def counting(self: SimulatedBench, its: np.ndarray, shared: np.ndarray) -> object:
        simulated[0] += len(its)
        return respond(self, its, shared)

    monkeypatch.setattr(SimulatedBench, "respond", counting)
    kept = fit_simulation(traces, Terms(HEAVY, ("quadratic_load_drag",)), points)
    few, simulated[0] = simulated[0], 0
    monkeypatch.setattr(slopes, "_CURVED", 0.0)
    all_of_them = fit_simulation(traces, Terms(HEAVY, ("quadratic_load_drag",)), points)
    assert few < 0.9 * simulated[0]
    assert kept.evidence.sum() == pytest.approx(all_of_them.evidence.sum(), abs=0.3)
    error = float(np.sqrt(all_of_them.covariance[0, 0]))
    assert kept.values[0] == pytest.approx(all_of_them.values[0], abs=0.1 * error)


def test_an_ended_fit_keeps_no_slopes(traced: Traced, truth: Model) -> None:
    traces, points = traced(truth)
    block = fit_simulation(traces, Terms(HEAVY), points).block
    predicted = block.base(points)
    own, _ = block.columns(points, (), predicted)
    moved = points + 0.01
    again, _ = block.columns(moved, (), block.base(moved))
    assert not np.array_equal(own, again)  # a hundredth is far for the most sensitive parameters
    block.forget()
    np.testing.assert_array_equal(block.columns(points, (), predicted)[0], own)
