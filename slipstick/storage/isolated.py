"""Reading an untrusted file in a child process with limited time and memory, where it may hang or crash without harm.

The checks of `storage.hdf5` bound what a file claims, but one wrong bit in its heap of texts can make the HDF5 library
loop for ever, and block every other reader in the same process.
"""

import importlib
import json
import resource
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from slipstick.errors import SlipstickError

_MEMORY = 4 << 30  # address space, most of it never touched
_ROOT = Path(__file__).parents[2]


def require_readable(content: bytes, reader: str, error: type[SlipstickError], seconds: int = 10) -> None:
    """Let `reader`, "module:function", read the bytes of a file in a child process.

    Raises `error` where the reader refuses the file with it, crashes, or takes more than `seconds` of processor time.
    """
    command = [sys.executable, "-c", f"from slipstick.storage.isolated import main; main({reader!r}, {seconds})"]
    try:
        done = subprocess.run(command, input=content, capture_output=True, timeout=6 * seconds, cwd=_ROOT,
                              check=False)
    except subprocess.TimeoutExpired:
        done = None
    if done is None or done.returncode:
        raise error("The HDF5 library hangs or crashes on the file", "Write the file again from its source")
    refusal = json.loads(done.stdout)
    if refusal:
        raise error(*refusal)


def main(reader: str, seconds: int) -> None:
    """Read the file on standard input; print its refusal as JSON (cause and remedy), or null."""
    with suppress(ValueError, OSError):  # not every system limits the address space
        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    module, _, function = reader.partition(":")
    refusal = None
    try:
        getattr(importlib.import_module(module), function)(sys.stdin.buffer.read())
    except SlipstickError as error:
        refusal = error.cause, error.remedy
    print(json.dumps(refusal))
