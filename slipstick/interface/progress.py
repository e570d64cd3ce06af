"""Progress of a long computation as one line: in a terminal and in a notebook a bar that is updated, in a log lines."""

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

_UPDATE_INTERVAL = 0.1
"""Shortest time in s between updates of a line on a terminal."""
_LOG_INTERVAL = 10.0
"""Shortest time in s between lines of a log that say how far a computation is."""
_BAR = 24
"""Characters of a bar."""
_WIDTH = 80
"""Characters of a line where the width of the terminal is not known."""


Show = Callable[[str, float | None], None]
"""Called with what a computation does now, in words, and with its share that is complete, from 0 to 1, if known."""
Count = Callable[[int, int, str, int], None]
"""Called with how many of how many items are done, what they are, and how many of them an earlier run did."""


class TimeEnded(Exception):
    """Raised within a computation that says what it does, when its time budget has ended."""


class ProgressLine:
    """Says on `stream`, by default stderr, how far a computation is.

    On a terminal and in a notebook, one line is written over and over, with a bar. Elsewhere, `log` writes lines: of
    steps each one, of counts one every ten seconds; without it nothing is written. Use it as a context manager, which
    ends the line.
    """

    def __init__(self, stream: TextIO | None = None, log: bool = False) -> None:
        self._stream = stream or sys.stderr
        self._is_updated = self._stream.isatty() or (stream is None and _is_notebook())
        self._log = log
        self._start = time.monotonic()
        self._width = 0
        self._rate = _Rate(_UPDATE_INTERVAL if self._is_updated else _LOG_INTERVAL)

    def __enter__(self) -> "ProgressLine":
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    @property
    def seconds(self) -> float:
        """Time since the computation began, in s."""
        return time.monotonic() - self._start

    def shown(self, progress: bool | Show) -> Show:
        """What is called with each step: the function that was given as `progress`, or this line if it is True."""
        if callable(progress):
            return progress
        return self.step if progress else lambda *_: None

    def step(self, text: str, share: float | None = None) -> None:
        """Say what the computation does now, and its `share` that is complete, from 0 to 1."""
        if self._is_updated:
            self._update(text, share)
        elif self._log:
            self._write_line(f"{self.seconds:6.1f} s  {text}")

    def count(self, done: int, total: int, items: str, resumed: int = 0) -> None:
        """Say that `done` of `total` items are done, `resumed` of them by an earlier run."""
        line = self._rate.line(done, total, items, resumed)
        if line is None:
            return
        if self._is_updated:
            self._update(line, done / total)
            if done >= total:
                self._end()
        elif self._log:
            self._write_line(line)

    def _write_line(self, text: str) -> None:
        """Write a line with its end at once: `print` writes them one after the other, and Ctrl-C may come between."""
        self._stream.write(f"{text}\n")
        self._stream.flush()

    def _update(self, text: str, share: float | None) -> None:
        filled = None if share is None else round(_BAR * min(max(share, 0.0), 1.0))
        bar = "" if filled is None else f"[{'#' * filled}{'.' * (_BAR - filled)}] "
        line = f"{bar}{text}"[:max(_columns(self._stream) - 1, _BAR)]
        print(f"\r{line.ljust(self._width)}", end="", file=self._stream, flush=True)
        self._width = len(line)

    def _end(self) -> None:
        if self._width:
            print(file=self._stream, flush=True)
            self._width = 0


@contextmanager
def counting(progress: "bool | Show | ProgressLine") -> Iterator[Count]:
    """What is called with counts: `progress` if it is a line or function, a new line if it is True, else nothing."""
    if isinstance(progress, ProgressLine):
        with progress:
            yield progress.count
    elif callable(progress):
        rate = _Rate(_UPDATE_INTERVAL)

        def show(done: int, total: int, items: str, resumed: int) -> None:
            line = rate.line(done, total, items, resumed)
            if line is not None:
                progress(line, done / total)

        yield show
    elif progress:
        with ProgressLine() as line:
            yield line.count
    else:
        yield lambda *_: None


class _Rate:
    """Counts in words, at most one in an `interval` in s, with the rate since the first one of the same items."""

    def __init__(self, interval: float) -> None:
        self._interval = interval
        self._counted: tuple[int, str] | None = None
        self._start = self._last = 0.0

    def line(self, done: int, total: int, items: str, resumed: int) -> str | None:
        """The count in words; None if there was one a moment ago, and this is not the last one."""
        now = time.monotonic()
        is_first, is_complete = self._counted != (total, items), done >= total
        if is_first:
            self._counted, self._start = (total, items), now
        elif not is_complete and now - self._last < self._interval:
            return None
        self._last = now
        words = f"{done:,} of {total:,} {items}"
        if resumed:
            words += f", {resumed:,} from an earlier run"
        if is_complete:
            self._counted = None
        seconds = now - self._start
        if (computed := done - resumed) and not is_first:
            rate = computed / max(seconds, 1e-9)
            words += f", {rate:,.0f} per second"
            words += f", {duration(seconds)} in total" if is_complete else (
                f", {duration((total - done) / rate)} remaining")
        return words


def duration(seconds: float) -> str:
    """A time in words, in a unit that suits it."""
    if seconds < 100:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _columns(stream: TextIO) -> int:
    """Characters of a line of the terminal that is written to, which need not be that of stdout."""
    try:
        return os.get_terminal_size(stream.fileno()).columns or _WIDTH
    except (OSError, ValueError):  # as in a notebook
        return _WIDTH


def _is_notebook() -> bool:
    """Whether this process is the kernel of a notebook, which shows what is written to stderr."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell"
