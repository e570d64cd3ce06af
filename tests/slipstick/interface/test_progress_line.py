"""A line of progress on a terminal, in a notebook, in a log and in a plain pipe."""

import fcntl
import io
import os
import pty
import struct
import subprocess
import sys
import termios
import time
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

from slipstick.interface.progress import ProgressLine, counting, duration

ROOT = Path(__file__).parents[3]
COUNTS = """
import sys, time
from slipstick.interface.progress import ProgressLine
with ProgressLine(log="log" in sys.argv) as line:
    for done in range(0, 1001, 250):
        line.count(done, 1000, "engagements", 250 * bool(done))
        time.sleep(0.11)
    line.step("a last step that has a text of more than eighty characters, which would break a line in two", 0.5)
    line.step("end")
print("after", file=sys.stderr)
"""


def run_on_terminal(columns: int) -> str:
    """What the program writes to a terminal of this width."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    process = subprocess.Popen([sys.executable, "-c", COUNTS], cwd=ROOT, stderr=theirs, stdout=subprocess.DEVNULL)
    os.close(theirs)
    written = b""
    try:
        while part := os.read(ours, 4096):
            written += part
    except OSError:  # how Linux tells that the other end is closed
        pass
    os.close(ours)
    assert process.wait() == 0
    return written.decode()


@pytest.mark.parametrize("columns", [60, 200])
def test_a_terminal_shows_one_line_that_fits_and_a_second_one_after_the_count(columns: int) -> None:
    lines = run_on_terminal(columns).split("\r\n")
    assert len(lines) == 4
    counts, steps, after, rest = lines
    assert (after, rest) == ("after", "")
    shown = counts.split("\r")[1:]
    assert shown[0].startswith(f"[{'.' * 24}] 0 of 1,000 engagements")
    assert shown[-1].startswith(f"[{'#' * 24}] 1,000 of 1,000 engag")
    assert len(shown) == 5
    assert all(len(line) < columns for line in (*shown, *steps.split("\r")))
    assert steps.split("\r")[-1].rstrip() == "end"
    assert len(steps.split("\r")[-1]) == len(steps.split("\r")[-2])  # nothing of the longer text stays


def run_in_pipe(*options: str) -> list[str]:
    completed = subprocess.run([sys.executable, "-c", COUNTS, *options], cwd=ROOT, capture_output=True, check=True)
    return completed.stderr.decode().split("\n")[:-1]


def test_nothing_is_written_to_a_pipe_unless_it_is_a_log() -> None:
    assert run_in_pipe() == ["after"]
    first, last, *steps, after = run_in_pipe("log")
    assert first == "0 of 1,000 engagements"
    assert last.startswith("1,000 of 1,000 engagements, 250 from an earlier run, ")
    assert " per second, " in last
    assert [step.partition(" s  ")[2][:6] for step in steps] == ["a last", "end"]
    assert after == "after"


def test_a_notebook_shows_a_line_that_is_updated() -> None:
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(COUNTS)])
    NotebookClient(notebook, resources={"metadata": {"path": str(ROOT)}}).execute()
    text = "".join(shown["text"] for shown in notebook.cells[0].outputs if shown.get("name") == "stderr").rstrip("\n")
    assert text.count("\r") == 7
    assert "\n".join(line.split("\r")[-1].rstrip() for line in text.split("\n")).endswith("end\nafter")


def test_a_file_is_not_a_notebook() -> None:
    file = io.StringIO()
    ProgressLine(file).count(1, 2, "runs")
    assert file.getvalue() == ""


def test_the_rate_is_that_of_the_present_items_since_their_first_count(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    log = io.StringIO()
    line = ProgressLine(log, log=True)
    for seconds, *count in ((100.0, 0, 50, "runs"), (105.0, 20, 50, "runs"), (110.0, 25, 50, "runs"),
                            (120.0, 50, 50, "runs"), (200.0, 0, 9, "steps"), (201.0, 9, 9, "steps")):
        clock[0] = seconds
        line.count(*count)
    assert log.getvalue().splitlines() == [
        "0 of 50 runs", "25 of 50 runs, 2 per second, 10.0 s remaining", "50 of 50 runs, 2 per second, 20.0 s in total",
        "0 of 9 steps", "9 of 9 steps, 9 per second, 1.0 s in total"]


def test_counts_go_to_a_line_a_function_or_nowhere(capsys: pytest.CaptureFixture[str]) -> None:
    said: list[tuple[str, float | None]] = []
    log = io.StringIO()
    for target in (lambda *step: said.append(step), ProgressLine(log, log=True), False, True):
        with counting(target) as count:
            count(0, 4, "runs", 0)
            count(4, 4, "runs", 0)
    assert [(text.partition(",")[0], share) for text, share in said] == [("0 of 4 runs", 0.0), ("4 of 4 runs", 1.0)]
    assert log.getvalue().startswith("0 of 4 runs\n4 of 4 runs, ")
    assert capsys.readouterr().err == ""


def test_durations_have_a_unit_that_suits_them() -> None:
    assert [duration(seconds) for seconds in (0.04, 99.0, 600.0, 7200.0)] == ["0.0 s", "99.0 s", "10 min", "2.0 h"]
