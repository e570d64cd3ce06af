"""What a study of a machine is doing, for those who wait for it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

Step = Literal["fit", "search", "simulate", "extend", "control"]
"""Blocks are fitted, laws are searched, and the whole machine is fitted without laws, with them, and with a control."""


@dataclass(frozen=True)
class Doing:
    """A `step` of a study that begins or goes on, and what is done in it, in `words`."""

    step: Step
    words: str


Log = Callable[[Doing], None]
