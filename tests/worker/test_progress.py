import io

from worker.progress import Progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_log_has_few_lines_and_ends_with_the_rate():
    log = io.StringIO()
    progress = Progress(1000, "engagements", log)
    for done in range(200, 1001):
        progress(done, 200)
    first, last = log.getvalue().splitlines()
    assert first == "200 of 1,000 engagements, 200 from an earlier run"
    assert last.startswith("1,000 of 1,000 engagements, 200 from an earlier run, ")
    assert " per second, " in last


def test_a_terminal_shows_one_updated_line():
    terminal = Terminal()
    progress = Progress(10, "engagements", terminal)
    for done in (0, 5, 10):
        progress(done, 0)
    assert terminal.getvalue().count("\n") == 1
    assert terminal.getvalue().endswith("\n")
    assert "\r10 of 10" in terminal.getvalue()
