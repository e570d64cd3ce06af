"""Conditions know their run order without being other conditions for it, and how their current came where it is."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.clutch.conditions import paper_conditions, reversals
from slipstick.errors import InvalidValue

PAPER = paper_conditions()


def test_the_run_order_is_kept_and_is_no_part_of_what_conditions_are() -> None:
    ordered = replace(PAPER, run_order=np.arange(216)[::-1])
    assert ordered.digest == PAPER.digest
    kept = ordered.take([3, 215])
    assert kept.run_order is not None
    assert kept.run_order.tolist() == [212, 0]
    assert PAPER.take([3]).run_order is None
    assert len(ordered.columns(in_order=True)) == len(PAPER.columns(in_order=True)) + 1 == len(ordered.columns()) + 1


@pytest.mark.parametrize("order", [np.arange(215), np.full(216, 0.5), np.full(216, np.nan)])
def test_run_orders_that_are_none_are_refused(order: np.ndarray) -> None:
    with pytest.raises(InvalidValue, match="run order is not one whole number a condition"):
        replace(PAPER, run_order=order)


def test_turns_of_a_current() -> None:
    current = np.array([0.1, 0.7, 0.7, 0.3, 0.3, 0.5, 0.2])
    directions, last, swings = reversals(current).T
    assert directions.tolist() == [1, 1, -1, -1, 1, -1, -1]
    assert last.tolist() == [0.1, 0.1, 0.7, 0.7, 0.3, 0.5, 0.5]
    np.testing.assert_allclose(swings, [0, 0, 0.6, 0.6, 0.4, 0.2, 0.2])
    assert reversals(np.array([0.4, 0.4])).tolist() == [[1, 0.4, 0], [1, 0.4, 0]]
    assert reversals(np.array([0.4, 0.2]))[:, 0].tolist() == [-1, -1]
