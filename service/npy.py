"""Arrays in the .npy format, read from untrusted clients."""

import io
import math
from collections.abc import AsyncIterator

import numpy as np
from starlette.responses import StreamingResponse

from slipstick.errors import InvalidValue

MEDIA_TYPE = "application/x-npy"
PIECE = 1 << 20
"""Bytes of an array that are sent at once."""
_HEADER_READERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def response(array: np.ndarray, headers: dict[str, str]) -> StreamingResponse:
    """Return the array as a .npy file.

    It is sent in pieces: a whole one would be copied into the buffer of the connection, where it waits for the client.
    """
    contiguous, header = np.ascontiguousarray(array), io.BytesIO()
    np.lib.format.write_array_header_1_0(header, np.lib.format.header_data_from_array_1_0(contiguous))
    numbers = contiguous.reshape(-1).view(np.uint8).data

    async def file() -> AsyncIterator[bytes | memoryview]:
        yield header.getvalue()
        async for piece in pieces(numbers):
            yield piece

    length = {"Content-Length": str(len(header.getvalue()) + len(numbers))}
    return StreamingResponse(file(), headers=headers | length, media_type=MEDIA_TYPE)


async def pieces(content: memoryview) -> AsyncIterator[memoryview]:
    """Yield the content in pieces of at most `PIECE` bytes, without a copy."""
    for start in range(0, len(content), PIECE):
        yield content[start:start + PIECE]


def load(content: bytes) -> np.ndarray:
    """Read a two-dimensional array (m, d) of numbers as float64.

    `np.load` allocates the memory that the header declares; here the declared size must match the bytes received.
    Raises `InvalidValue`.
    """
    stream = io.BytesIO(content)
    try:
        shape, fortran_order, dtype = _HEADER_READERS[np.lib.format.read_magic(stream)](stream)
    except (ValueError, KeyError, SyntaxError, TypeError, RecursionError, MemoryError) as error:
        raise InvalidValue("The request body is not a .npy file of version 1 or 2",
                           "Write it with numpy.save") from error
    # The header is a Python literal: `True` is an int for its reader.
    if dtype.kind not in "fiu" or len(shape) != 2 or any(type(length) is not int for length in shape):
        raise InvalidValue(f"The request body is an array of type {dtype} and shape {shape}, not a two-dimensional "
                           "array of real numbers", "Send a float64 array of shape (points, axes)")
    if min(shape) < 1 or math.prod(shape) * dtype.itemsize != len(content) - stream.tell():
        raise InvalidValue(f"The array is empty, or the length of the request body does not match its shape {shape}",
                           "Write it again with numpy.save")
    values = np.frombuffer(content, dtype, offset=stream.tell())
    return values.reshape(shape, order="F" if fortran_order else "C").astype(np.float64)
