"""How far a long command is: one line that rewrites itself on a terminal, a line now and then elsewhere."""

import sys
import time
from typing import TextIO

_SECONDS_APART = 10.0
"""Between two lines where the output is no terminal, so that a log is not flooded."""


class Progress:
    """Tells on `stream`, stderr by default, how many of `total` items are done, how fast, and how long is left."""

    def __init__(self, total: int, what: str, stream: TextIO | None = None) -> None:
        self._total, self._what, self._stream = total, what, stream or sys.stderr
        self._begun = time.monotonic()
        self._told = 0.0

    def __call__(self, done: int, left_over: int) -> None:
        """Say that `done` items are ready, `left_over` of them from before this run."""
        now = time.monotonic()
        live = self._stream.isatty()
        if done < self._total and now - self._told < (0.1 if live else _SECONDS_APART):
            return
        self._told = now
        spent, fresh = now - self._begun, done - left_over
        line = f"{done:,} of {self._total:,} {self._what}"
        if left_over:
            line += f", {left_over:,} from before"
        if fresh:
            rate = fresh / max(spent, 1e-9)
            line += f", {rate:,.0f} a second"
            line += f", {_span((self._total - done) / rate)} left" if done < self._total else f", {_span(spent)}"
        print(f"\r{line}\x1b[K" if live else line, end="" if live and done < self._total else "\n", flush=True,
              file=self._stream)


def _span(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
