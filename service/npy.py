"""Arrays as .npy, read from callers nobody vouches for."""

import io
import math

import numpy as np

from slipstick.errors import InvalidValue

MEDIA_TYPE = "application/x-npy"
_READERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def dump(array: np.ndarray) -> bytes:
    """The array as the bytes of a .npy file."""
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=False)
    return stream.getvalue()


def load(content: bytes) -> np.ndarray:
    """Read a table of numbers (m, d) as float64.

    `np.load` would reserve whatever memory the header claims; here the claim must fit the bytes that came.
    Raises `InvalidValue`.
    """
    stream = io.BytesIO(content)
    try:
        shape, fortran, kind = _READERS[np.lib.format.read_magic(stream)](stream)
    except (ValueError, KeyError, SyntaxError, TypeError, RecursionError, MemoryError) as reason:
        raise InvalidValue("The body is not a .npy file of version 1 or 2", "Write it with numpy.save") from reason
    if kind.kind not in "fiu" or len(shape) != 2:
        raise InvalidValue(f"The body holds {kind} of shape {shape}, not a table of numbers",
                           "Send a float64 array of shape (points, axes)")
    if min(shape) < 1 or math.prod(shape) * kind.itemsize != len(content) - stream.tell():
        raise InvalidValue(f"The body is empty or does not hold the {shape} numbers it claims",
                           "Write it again with numpy.save")
    values = np.frombuffer(content, kind, offset=stream.tell())
    return values.reshape(shape, order="F" if fortran else "C").astype(np.float64)
