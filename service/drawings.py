"""Reports and pictures of jobs, made in a child process that stays, since its first picture takes a second.

In a thread of the service they would delay all other requests, the health check among them.
"""

import threading
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import orjson

from slipstick.errors import UnknownName
from slipstick.storage.children import Kept

from .held import held

_CHILD = Kept()


class Drawings:
    """Makes one page or picture at a time, and keeps `most_bytes` of them."""

    def __init__(self, most_bytes: int = 32 << 20) -> None:
        self._most_bytes = most_bytes
        self._lock = threading.Lock()
        self._kept: dict[tuple[str, ...], bytes] = {}

    def prepare(self) -> None:
        """Draw a first picture, which nobody waits for."""
        _CHILD.call("slipstick.report.made:prepare", b"", UnknownName)

    def made(self, function: str, request: Callable[[], Mapping[str, Any]], *key: str) -> bytes:
        """Return what `function` of slipstick.report.made returns for `request`, which is called unless it was kept.

        Together with the function, `key` identifies the request; without one, nothing is kept. Raises `UnknownName`.
        """
        with self._lock:
            drawing = self._kept.pop((function, *key), None)  # and inserted again below, as the newest
            if drawing is None:
                content = orjson.dumps(request(), option=orjson.OPT_SERIALIZE_NUMPY)
                drawing = _CHILD.call(f"slipstick.report.made:{function}", content, UnknownName)
            if key:
                self._kept[function, *key] = drawing
                while sum(map(len, self._kept.values())) > self._most_bytes:
                    del self._kept[next(iter(self._kept))]
        return drawing


DrawingsDependency = Annotated[Drawings, held("drawings")]
