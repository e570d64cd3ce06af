"""The process of the steps: stopped in the middle of a step, and replaced after a crash."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from slipstick.errors import InvalidValue
from slipstick.storage.children import Forking
from worker.computing import ComputationLost, Computer, Report, TimeEnded, forking_of


class Cancelled(Exception):
    pass


def process(library: Any, report: Any) -> int:
    return os.getpid()


def endless(library: Any, report: Any) -> None:
    report({"pid": os.getpid()})
    time.sleep(600)


def reporting(library: Any, report: Any, count: int) -> int:
    for number in range(count):
        report({"number": number})
    return count


def keeping(library: Any, report: Report, count: int) -> None:
    for number in range(count):
        report.keep({"number": number})
    time.sleep(600)


def failing(library: Any, report: Any, error: Exception) -> None:
    raise error


def crashing(library: Any, report: Any) -> None:
    os._exit(1)


@pytest.fixture(scope="module")
def forking() -> Forking:
    return forking_of(())


@pytest.fixture
def computer(forking: Forking, tmp_path: Path) -> Iterator[Computer]:
    computer = Computer(tmp_path, forking)
    yield computer
    computer.stop()


def run(computer: Computer, step: Any, *arguments: Any, report: Any = lambda progress: None,
        require_wanted: Any = lambda: None, **options: float) -> Any:
    return computer.run(step, *arguments, report=report, require_wanted=require_wanted, **options)


def require_ended(pid: int) -> None:
    """Wait until a killed process has ended, which it has not yet where its files are closed."""
    deadline = time.monotonic() + 60
    while is_running(pid):
        assert time.monotonic() < deadline
        time.sleep(0.01)


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):  # it has ended before, or while it was read
        return False


def test_a_cancelled_step_ends_in_the_middle(computer: Computer) -> None:
    reports: list[dict[str, Any]] = []

    def require_wanted() -> None:
        if reports:
            raise Cancelled

    begin = time.monotonic()
    with pytest.raises(Cancelled):
        run(computer, endless, report=reports.append, require_wanted=require_wanted)
    assert time.monotonic() < begin + 60
    require_ended(reports[0]["pid"])
    after = run(computer, process)
    assert after not in (reports[0]["pid"], os.getpid())
    assert run(computer, process) == after


def test_a_report_can_end_a_step(computer: Computer) -> None:
    numbers: list[int] = []

    def report(progress: dict[str, Any]) -> None:
        numbers.append(progress["number"])
        if len(numbers) == 2:
            raise Cancelled

    with pytest.raises(Cancelled):
        run(computer, reporting, 5, report=report)
    assert numbers == [0, 1]
    assert run(computer, reporting, 3) == 3


@pytest.mark.parametrize(("count", "kept"), [(0, None), (3, {"number": 2})])
def test_a_step_whose_time_ends_leaves_what_it_has_kept(computer: Computer, count: int,
                                                        kept: dict[str, int] | None) -> None:
    pid = run(computer, process, seconds=60)
    with pytest.raises(TimeEnded) as ended:
        run(computer, keeping, count, seconds=1.0)
    assert ended.value.kept == kept
    assert 1.0 <= ended.value.seconds < 30
    require_ended(pid)
    assert run(computer, process) != pid


def test_errors_come_back_and_a_crash_is_one(computer: Computer) -> None:
    pid = run(computer, process)
    with pytest.raises(InvalidValue, match="The cause"):
        run(computer, failing, InvalidValue("The cause", "the remedy"))
    with pytest.raises(RuntimeError, match="ZeroDivisionError: by zero"):
        run(computer, failing, ZeroDivisionError("by zero"))
    assert run(computer, process) == pid
    with pytest.raises(ComputationLost, match="killed or crashed"):
        run(computer, crashing)
    after = run(computer, process)
    assert after != pid
    os.kill(after, signal.SIGKILL)  # between two steps
    while not computer._process.has_ended():  # /proc shows a zombie while its last threads still end
        time.sleep(0.01)
    assert run(computer, process) != after


def test_the_process_ends_with_the_worker(tmp_path: Path) -> None:
    code = ("import os, sys; from pathlib import Path; sys.path.insert(0, sys.argv[1])\n"
            "from test_computing import endless, run; from worker.computing import Computer, forking_of\n"
            "if __name__ == '__main__':\n"
            "    run(Computer(Path('.'), forking_of(())), endless,\n"
            "        report=lambda progress: print(progress['pid'], flush=True))")
    (tmp_path / "start.py").write_text(code)
    worker = subprocess.Popen([sys.executable, tmp_path / "start.py", Path(__file__).parent], stdout=subprocess.PIPE,
                              env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])})
    assert worker.stdout is not None
    pid = int(worker.stdout.readline())
    assert is_running(pid)
    worker.kill()
    worker.wait()
    require_ended(pid)
