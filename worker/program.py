"""The name under which the command was started, for messages with further commands."""

import shlex
from pathlib import Path

from slipstick.storage.shipped import FOLDER

PACKAGE = str(__package__)
"""`worker` in a checkout, `slipstick_worker` where the package is installed."""
SERVICE = PACKAGE.replace("worker", "service")
"""The package of the service, which is started as a program: the worker never imports it."""


def program() -> str:
    """`slipstick`, the script of an installation, or the call of the package in a checkout."""
    return "python -m worker" if PACKAGE == "worker" else "slipstick"


def command_line(*words: str | Path) -> str:
    """A further command, for a shell."""
    named = (word.stem if isinstance(word, Path) and word.parent == FOLDER and PACKAGE != "worker" else word
             for word in words)  # a shipped bench by its name
    return f"{program()} {shlex.join(map(str, named))}"
