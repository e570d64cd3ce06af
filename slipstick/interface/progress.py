"""Progress of a long computation as one line: in a terminal and in a notebook a bar that is updated, in a log lines."""

import shutil
import sys
import time
from typing import TextIO

_UPDATE_INTERVAL = 0.1
"""Shortest time in s between updates of a line on a terminal."""
_LOG_INTERVAL = 10.0
"""Shortest time in s between lines of a log that say how far a computation is."""
_BAR = 24
"""Characters of a bar."""


class ProgressLine:
    """Says on `stream`, by default stderr, how far a computation is.

    On a terminal and in a notebook, one line is written over and over, with a bar. Elsewhere, `log` writes lines: of
    steps each one, of counts one every ten seconds; without it nothing is written. Use it as a context manager, which
    ends the line.
    """

    def __init__(self, stream: TextIO | None = None, log: bool = False) -> None:
        self._stream = stream or sys.stderr
        self._is_updated = self._stream.isatty() or _is_notebook()
        self._log = log
        self._start = time.monotonic()
        self._last = -_LOG_INTERVAL
        self._width = 0

    def __enter__(self) -> "ProgressLine":
        return self

    def __exit__(self, *_: object) -> None:
        if self._width:
            print(file=self._stream, flush=True)
            self._width = 0

    @property
    def seconds(self) -> float:
        """Time since the computation began, in s."""
        return time.monotonic() - self._start

    def step(self, text: str, share: float | None = None) -> None:
        """Say what the computation does now, and its `share` that is complete, from 0 to 1."""
        if self._is_updated:
            self._update(text, share)
        elif self._log:
            print(f"{self.seconds:6.1f} s  {text}", file=self._stream, flush=True)

    def count(self, done: int, total: int, items: str, resumed: int = 0) -> None:
        """Say that `done` of `total` items are done, `resumed` of them by an earlier run."""
        is_complete, now = done >= total, time.monotonic()
        if not is_complete and now - self._last < (_UPDATE_INTERVAL if self._is_updated else _LOG_INTERVAL):
            return
        self._last = now
        line = f"{done:,} of {total:,} {items}"
        if resumed:
            line += f", {resumed:,} from an earlier run"
        if computed := done - resumed:
            rate = computed / max(self.seconds, 1e-9)
            line += f", {rate:,.0f} per second"
            line += f", {duration(self.seconds)} in total" if is_complete else (
                f", {duration((total - done) / rate)} remaining")
        if self._is_updated:
            self._update(line, done / total)
        elif self._log:
            print(line, file=self._stream, flush=True)

    def _update(self, text: str, share: float | None) -> None:
        filled = None if share is None else round(_BAR * share)
        bar = "" if filled is None else f"[{'#' * filled}{'.' * (_BAR - filled)}] "
        line = f"{bar}{text}"[:max(shutil.get_terminal_size().columns - 1, _BAR)]
        print(f"\r{line.ljust(self._width)}", end="", file=self._stream, flush=True)
        self._width = len(line)


def duration(seconds: float) -> str:
    """A time in words, in a unit that suits it."""
    if seconds < 100:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _is_notebook() -> bool:
    """Whether this process is the kernel of a notebook, which shows what is written to stderr."""
    return "ipykernel" in sys.modules
