"""Naming in threads gives what it gives in one, bit for bit."""

import threading
from pathlib import Path

import numpy as np
import pytest

from slipstick.naming.settings import NamingSettings
from slipstick.naming.study import Naming, name
from slipstick.numerics import threads
from slipstick.recordings import Recordings
from tests.benches import HEAVY

MEASURED = Path(__file__).parents[3] / "tables/measured.h5"


def allow(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let compiled kernels use so many threads: tests in parallel have one each."""
    monkeypatch.setattr(threads, "get_num_threads", lambda: count)


def test_parts_are_computed_in_threads_and_come_in_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    meet = threading.Barrier(2, timeout=20)

    def part(number: int) -> int:
        meet.wait()
        return 10 * number

    allow(2, monkeypatch)
    assert threads.mapped(part, [3, 1]) == [30, 10]


@pytest.mark.parametrize("count", [1, 2])
def test_an_error_of_a_part_is_raised(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    allow(count, monkeypatch)
    with pytest.raises(ZeroDivisionError):
        threads.mapped(lambda number: 1 // number, [1, 0, 2])


def named(count: int, monkeypatch: pytest.MonkeyPatch) -> Naming:
    allow(count, monkeypatch)
    return name(HEAVY, Recordings.open(MEASURED).take(np.arange(0, 216, 18)), NamingSettings(fewest=12, most=1))


def test_naming_in_two_threads_is_that_in_one(monkeypatch: pytest.MonkeyPatch) -> None:
    one, two = named(1, monkeypatch), named(2, monkeypatch)
    assert one.findings
    for its, other in zip(one.findings, two.findings, strict=True):
        assert its.pair == other.pair
        np.testing.assert_array_equal(its.gain, other.gain)
    assert one.chi_square == two.chi_square
