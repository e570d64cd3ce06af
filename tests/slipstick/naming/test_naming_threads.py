"""Naming in threads gives what it gives in one, bit for bit."""

import threading
from pathlib import Path

import numpy as np
import pytest
from numba import get_num_threads, set_num_threads

from slipstick.naming.study import Naming, name
from slipstick.naming.threads import mapped
from slipstick.recordings import Recordings
from tests.benches import HEAVY

MEASURED = Path(__file__).parents[3] / "tables/measured.h5"

several = pytest.mark.skipif(get_num_threads() < 2, reason="needs two cores")


@several
def test_parts_are_computed_in_threads_and_come_in_their_order() -> None:
    meet = threading.Barrier(2, timeout=20)

    def part(number: int) -> int:
        meet.wait()
        return 10 * number

    assert mapped(part, [3, 1]) == [30, 10]


def test_an_error_of_a_part_is_raised() -> None:
    with pytest.raises(ZeroDivisionError):
        mapped(lambda number: 1 // number, [1, 0, 2])


def named(threads: int) -> Naming:
    before = get_num_threads()
    set_num_threads(threads)
    try:
        return name(HEAVY, Recordings.open(MEASURED).take(np.arange(0, 216, 9)))
    finally:
        set_num_threads(before)


@several
def test_naming_in_two_threads_is_that_in_one() -> None:
    one, two = named(1), named(2)
    assert one.findings
    for its, other in zip(one.findings, two.findings, strict=True):
        assert its.pair == other.pair
        np.testing.assert_array_equal(its.gain, other.gain)
    assert one.chi_square == two.chi_square
