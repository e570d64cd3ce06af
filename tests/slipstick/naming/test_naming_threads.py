"""Naming in threads gives what it gives in one, bit for bit."""

import threading
from dataclasses import replace
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


@pytest.mark.parametrize("without", ["pressure", pytest.param("none", marks=pytest.mark.slow)])
def test_naming_in_two_threads_is_that_in_one(monkeypatch: pytest.MonkeyPatch, without: str) -> None:
    recordings = Recordings.open(MEASURED).take(np.arange(0, 216, 18))
    assert recordings.signals is not None
    if without == "pressure":  # and so without the clutch, which takes most of the time
        recordings = replace(recordings, signals=replace(recordings.signals, pressure=None))
    answers = list[Naming]()
    for count in (1, 2):
        allow(count, monkeypatch)
        answers.append(name(HEAVY, recordings, NamingSettings(fewest=12, most=1)))
    for one, other in zip(*(answer.findings for answer in answers), strict=True):
        assert one.pair == other.pair
        np.testing.assert_array_equal(one.gain, other.gain)
    assert bool(answers[0].findings) == (without == "none")
    assert list(answers[0].parameters) == list(answers[1].parameters)
    for parameter, values in answers[0].parameters.items():
        np.testing.assert_array_equal(values, answers[1].parameters[parameter])
    assert answers[0].chi_square == answers[1].chi_square
