"""Child processes with their own limits, errors and end; and files that are opened again only if they have changed."""

import json
import os
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from slipstick.errors import InvalidValue
from slipstick.storage import children, versions
from slipstick.table import Table


def call(function: str, content: bytes = b"", limits: children.Limits | None = None) -> bytes:
    return children.call(f"tests.child_functions:{function}", content, InvalidValue, limits)


def test_forks_of_one_process_answer_at_the_same_time() -> None:
    with ThreadPoolExecutor(4) as pool:
        found = [json.loads(answer) for answer in pool.map(lambda _: call("processes"), range(8))]
    assert len({own for own, _ in found}) == 8
    assert len({parent for _, parent in found} - {os.getpid()}) == 1


def test_forks_have_the_units_that_take_a_third_of_a_second() -> None:
    assert call("count_registries") == b"1"


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


def test_a_kept_child_answers_again_and_again() -> None:
    child = children.Kept()

    def call(function: str, content: bytes = b"") -> bytes:
        return child.call(f"tests.child_functions:{function}", content, InvalidValue)

    own, parent = json.loads(call("processes"))
    assert call("doubled", bytes(3 << 20)) == bytes(6 << 20)
    with pytest.raises(InvalidValue, match="It is damaged"):
        call("refuse", b"It is damaged")
    with pytest.raises(children.ChildFailed, match="AttributeError"):
        call("missing")
    assert json.loads(call("processes")) == [own, parent]
    with pytest.raises(children.ChildFailed, match="without an answer"):
        call("crash")
    other, parent_of_other = json.loads(call("processes"))
    assert (parent_of_other, other != own) == (parent, True)


def test_a_kept_child_and_the_process_that_forks_end_with_a_killed_parent() -> None:
    code = ("import sys; from slipstick.errors import InvalidValue; from slipstick.storage.children import Kept\n"
            "child = Kept()\n"
            "print(child.call('tests.child_functions:processes', b'', InvalidValue).decode(), flush=True)\n"
            "sys.stdin.read()")
    process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdout is not None
    started = json.loads(process.stdout.readline())
    process.kill()
    process.communicate()
    deadline = time.monotonic() + 20
    while any(_is_running(number) for number in started):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def _is_running(number: int) -> bool:
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


# Files that are opened again only if they have changed.


class Read:
    """What stands for the content of a file."""


def test_who_asks_for_a_table_while_it_is_read_gets_the_same_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch
                                                                 ) -> None:
    both, reads = threading.Barrier(2, timeout=1.0), list[Path]()

    def read(path: Path) -> Read:
        reads.append(path)
        with suppress(threading.BrokenBarrierError):
            both.wait()  # two that read at once would meet here
        return Read()

    monkeypatch.setattr(Table, "open", read)
    version = (tmp_path / "table.h5", 1, 1)
    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(versions.open_table, [version] * 2)
    assert first is second is versions.known_table(version)
    assert len(reads) == 1
