"""Reading an untrusted file in a child process with limited time and memory.

The checks of `storage.hdf5` bound the sizes that a file declares. Nevertheless a single wrong bit in the heap of
variable-length text can send the HDF5 library into an endless loop, which blocks all other readers in the process.
"""

import importlib
import json
import resource
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from slipstick.errors import SlipstickError

_MEMORY = 4 << 30  # bytes of address space, most of it never used
_ROOT = Path(__file__).parents[2]


def require_readable(content: bytes, reader: str, error: type[SlipstickError], seconds: int = 10) -> None:
    """Read the bytes of a file with `reader`, "module:function", in a child process.

    Raises `error` if the reader raises it, crashes, or takes more than `seconds` of processor time.
    """
    command = [sys.executable, "-c", f"from slipstick.storage.isolated import main; main({reader!r}, {seconds})"]
    try:
        process = subprocess.run(command, input=content, capture_output=True, timeout=6 * seconds, cwd=_ROOT,
                                 check=False)
    except subprocess.TimeoutExpired:
        process = None
    if process is None or process.returncode:
        raise error("The HDF5 library hangs or crashes while reading the file",
                    "Write the file again from the original data")
    cause_and_remedy = json.loads(process.stdout)
    if cause_and_remedy:
        raise error(*cause_and_remedy)


def main(reader: str, seconds: int) -> None:
    """Read the file on standard input; print the error as JSON (cause and remedy), or null."""
    with suppress(ValueError, OSError):  # not every system limits the address space
        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    module, _, function = reader.partition(":")
    cause_and_remedy = None
    try:
        getattr(importlib.import_module(module), function)(sys.stdin.buffer.read())
    except SlipstickError as error:
        cause_and_remedy = error.cause, error.remedy
    print(json.dumps(cause_and_remedy))
