"""Progress of a long command: one line that is updated on a terminal, or a line every ten seconds in a log."""

import sys
import time
from typing import TextIO

_LOG_INTERVAL = 10.0  # s
_TERMINAL_INTERVAL = 0.1  # s


class Progress:
    """Print to `stream`, by default stderr, how many of `total` items are done, the rate and the remaining time."""

    def __init__(self, total: int, items: str, stream: TextIO | None = None) -> None:
        self._total, self._items, self._stream = total, items, stream or sys.stderr
        self._start = time.monotonic()
        self._last_print = 0.0

    def __call__(self, done: int, resumed: int) -> None:
        """Print that `done` items are done, `resumed` of them by an earlier run."""
        now = time.monotonic()
        is_terminal, is_complete = self._stream.isatty(), done >= self._total
        if not is_complete and now - self._last_print < (_TERMINAL_INTERVAL if is_terminal else _LOG_INTERVAL):
            return
        self._last_print = now
        elapsed, computed = now - self._start, done - resumed
        line = f"{done:,} of {self._total:,} {self._items}"
        if resumed:
            line += f", {resumed:,} from an earlier run"
        if computed:
            rate = computed / max(elapsed, 1e-9)
            line += f", {rate:,.0f} per second"
            line += f", {_duration(elapsed)} in total" if is_complete else (
                f", {_duration((self._total - done) / rate)} remaining")
        print(f"\r{line}\x1b[K" if is_terminal else line, end="" if is_terminal and not is_complete else "\n",
              flush=True, file=self._stream)


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
