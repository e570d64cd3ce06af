"""Ids of requests: from the header X-Request-ID of the client, or new; in the response, in problems and in the log."""

import re
import uuid
from contextvars import ContextVar

HEADER = "X-Request-ID"
_WELL_FORMED = re.compile(r"[A-Za-z0-9._-]{1,64}")
current: ContextVar[str | None] = ContextVar("request_id", default=None)
"""Id of the request that is being answered, also in the threads that compute for it."""


def request_id(given: str) -> str:
    """Return the id that the client gave, or a new one if it gave none or one with other characters."""
    return given if _WELL_FORMED.fullmatch(given) else uuid.uuid4().hex
