"""A first reading of a stranger's HDF5 file, in a process that may hang, crash or swell without harm.

The checks of `slipstick.hdf5` bound what a file claims, but one wrong bit in its heap of texts is enough to send
the HDF5 library itself round for ever, and with it every other reader in the process.
"""

import json
import resource
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from slipstick.errors import BadRecording
from slipstick.recordings import hdf5_form

_MEMORY = 4 << 30  # address space, most of it never touched
_ROOT = Path(__file__).parents[2]


def require_readable(content: bytes, seconds: int = 10) -> None:
    """Raise `BadRecording` where the HDF5 file is refused, or takes more than `seconds` of processor time."""
    command = [sys.executable, "-c", f"from slipstick.recordings.apart import main; main({seconds})"]
    try:
        done = subprocess.run(command, input=content, capture_output=True, timeout=6 * seconds, cwd=_ROOT,
                              check=False)
    except subprocess.TimeoutExpired:
        done = None
    if done is None or done.returncode:
        raise BadRecording("The HDF5 library hangs or crashes on the file", "Write the file again from its source")
    refused = json.loads(done.stdout)
    if refused:
        raise BadRecording(*refused)


def main(seconds: int) -> None:
    """Read the file on standard input and print as JSON why it is refused, null if it is not."""
    with suppress(ValueError, OSError):  # not every system limits the address space
        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    refused = None
    try:
        hdf5_form.read(sys.stdin.buffer.read())
    except BadRecording as error:
        refused = error.cause, error.remedy
    print(json.dumps(refused))
