"""Run order of conditions, and reversals of their current profiles."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.bench.conditions import reversals
from slipstick.errors import InvalidValue
from tests.benches import HEAVY

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
