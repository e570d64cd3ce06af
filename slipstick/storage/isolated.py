"""Work on untrusted files in a child process with limited processor time and memory.

The checks of `storage.hdf5` bound the sizes that a file declares. Nevertheless a single wrong bit in the heap of
variable-length text can send the HDF5 library into an endless loop, which blocks all other readers in the process. The
libraries for other formats have no such checks at all.
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
    isolated(content, reader, error, seconds, "The HDF5 library hangs or crashes while reading the file")


def isolated(content: bytes, function: str, error: type[SlipstickError], seconds: int, failure: str) -> bytes:
    """Bytes that `function`, "module:function", returns for `content` in a child process; empty if it returns others.

    Raises `error` if the function raises a `SlipstickError`, and with the cause `failure` if it crashes, or takes more
    than `seconds` of processor time or its share of memory.
    """
    command = [sys.executable, "-c", f"from slipstick.storage.isolated import main; main({function!r}, {seconds})"]
    try:
        process = subprocess.run(command, input=content, capture_output=True, timeout=6 * seconds, cwd=_ROOT,
                                 check=False)
    except subprocess.TimeoutExpired:
        process = None
    if process is None or process.returncode:
        raise error(failure, "Write the file again from the original data")
    said, _, result = process.stdout.partition(b"\n")
    cause_and_remedy = json.loads(said)
    if cause_and_remedy:
        raise error(*cause_and_remedy)
    return result


def main(function: str, seconds: int) -> None:
    """Call the function with standard input; write a line with its error (cause and remedy, or null), and its bytes."""
    with suppress(ValueError, OSError):  # not every system limits the address space
        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    module, _, name = function.partition(":")
    cause_and_remedy, result = None, None
    try:
        result = getattr(importlib.import_module(module), name)(sys.stdin.buffer.read())
    except SlipstickError as error:
        cause_and_remedy = error.cause, error.remedy
    print(json.dumps(cause_and_remedy), flush=True)
    if isinstance(result, bytes):
        sys.stdout.buffer.write(result)
        sys.stdout.buffer.flush()
