"""Work on untrusted files in a child process with limited processor time and memory.

The checks of `storage.hdf5` bound the sizes that a file declares. Nevertheless a single wrong bit in the heap of
variable-length text can send the HDF5 library into an endless loop, which blocks all other readers in the process. The
libraries for other formats have no such checks at all.
"""

from slipstick.errors import SlipstickError
from slipstick.storage import children

_MEMORY = 4 << 30  # bytes of address space, most of it never used


def require_readable(content: bytes, reader: str, error: type[SlipstickError], seconds: int = 10) -> bytes:
    """Read the bytes of a file with `reader`, "module:function", in a child process, and return what `isolated` does.

    Raises `error` if the reader raises it, crashes, or takes more than `seconds` of processor time.
    """
    return isolated(content, reader, error, seconds, "The HDF5 library hangs or crashes while reading the file")


def isolated(content: bytes, function: str, error: type[SlipstickError], seconds: int, failure: str) -> bytes:
    """Bytes that `function`, "module:function", returns for `content` in a child process; empty if it returns others.

    Raises `error` if the function raises a `SlipstickError`, and with the cause `failure` if it crashes, or takes more
    than `seconds` of processor time or its share of memory.
    """
    try:
        return children.call(function, content, error, children.Limits(seconds, _MEMORY))
    except children.ChildFailed:
        raise error(failure, "Write the file again from the original data") from None
