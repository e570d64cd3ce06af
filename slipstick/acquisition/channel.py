"""A channel of a file of a data-acquisition system, and what a reader of such files offers."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Protocol

import numpy as np

from slipstick.errors import BadRecording

LARGEST = 50_000_000
"""Most samples of one channel: 400 MB in memory."""


@dataclass(frozen=True)
class Listed:
    """A channel in the list of a file: its `name`, its `unit` ("" where the file states none), and its `samples`."""

    name: str
    unit: str
    samples: int


@dataclass(frozen=True, eq=False)
class Channel:
    """The `values` (k,) of a channel in the unit that its file states, "" where it states none.

    `time` (k,) in s comes with the channel (MDF), or is None where the file has it as another channel, or has none for
    the reason `no_time`. A missing value is NaN. `note` says what was assumed.
    """

    name: str
    unit: str
    values: np.ndarray
    time: np.ndarray | None = None
    no_time: str = ""
    note: str = ""


class Source(Protocol):
    """An open file. `remarks` say what its reader found out about the format without being told."""

    name: str
    remarks: tuple[str, ...]

    def listed(self) -> tuple[Listed, ...]:
        """The channels of numbers."""
        ...

    def channel(self, name: str) -> Channel:
        """Read one channel; raises `BadRecording` with the names of the file and of similar channels."""
        ...


def unknown_channel(source: str, name: str, known: Iterable[str]) -> BadRecording:
    """The error about a channel that a file does not have; the remedy suggests similar names."""
    names = list(known)
    near = get_close_matches(name, names, n=3, cutoff=0.4)
    suggestions = ", ".join(near or sorted(names)[:20]) or "no channel of numbers"
    hint = f"Did you mean {suggestions}?" if near else f"It has {suggestions}."
    return BadRecording(f"{source} has no channel '{name}'", f"{hint} Correct the mapping, or leave the file out")


def unreadable(source: str, form: str, error: Exception,
               remedy: str = "Export it again, or leave it out") -> BadRecording:
    """The error about a damaged file, with the reason that the library of its `form` gives."""
    said = re.sub(r"'?<[^<>]* object at 0x[0-9a-f]+>'?", "it", str(error))  # a library names a file in memory so
    reason = " ".join(said.split())[:200] or type(error).__name__
    return BadRecording(f"{source} cannot be read as {form} ({reason})", remedy)

