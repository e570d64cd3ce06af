"""Child processes: forks of one process that stays, each with its own limits, errors and end."""

import json
import os
from concurrent.futures import ThreadPoolExecutor

import pytest

from slipstick.errors import InvalidValue
from slipstick.storage import children


def call(function: str, content: bytes = b"", limits: children.Limits | None = None) -> bytes:
    return children.call(f"tests.child_functions:{function}", content, InvalidValue, limits)


def test_forks_of_one_process_answer_at_the_same_time() -> None:
    with ThreadPoolExecutor(4) as pool:
        found = [json.loads(answer) for answer in pool.map(lambda _: call("processes"), range(8))]
    assert len({own for own, _ in found}) == 8
    assert len({parent for _, parent in found} - {os.getpid()}) == 1


def test_content_of_any_size_goes_there_and_comes_back() -> None:
    content = os.urandom(20 << 20)
    assert call("doubled", content) == 2 * content
    assert call("doubled") == b""


def test_errors_keep_cause_and_remedy_and_others_their_traceback() -> None:
    with pytest.raises(InvalidValue) as refused:
        call("refuse", b"It is damaged")
    assert (refused.value.cause, refused.value.remedy) == ("It is damaged", "Build it again")
    with pytest.raises(children.ChildFailed, match="AttributeError"):
        call("missing")


@pytest.mark.parametrize("function", ["crash", "compute_for_ever", "sleep_for_ever"])
def test_a_child_that_crashes_or_exceeds_its_limits_fails(function: str) -> None:
    content = bytes(1 << 20)  # which a child that has died does not read
    with pytest.raises(children.ChildFailed, match="without an answer"):
        call(function, content, children.Limits(1, 8 << 30))
    assert call("doubled", b"a") == b"aa"


def test_the_process_that_forks_is_started_again() -> None:
    _, forking = json.loads(call("processes"))
    children._FORKING.end()
    _, other = json.loads(call("processes"))
    assert other != forking
