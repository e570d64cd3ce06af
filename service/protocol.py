"""HTTP/1.1 connections: protocol errors are problem details as well, and clients that are too slow are disconnected."""

import asyncio
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from . import request_ids
from .problem_details import MEDIA_TYPE, malformed_request


class Connection(H11Protocol):
    """A connection of uvicorn that is closed if its client takes more than `seconds` s to send the headers or to read.

    Bodies have a limit of their own (bodies.py).
    """

    def __init__(self, *arguments: Any, seconds: float, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.seconds = seconds
        self.deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for the first request."""
        super().connection_made(transport)
        self._close_later()

    def data_received(self, data: bytes) -> None:
        """Take bytes of a request; its first byte starts the time for its headers."""
        waiting = self.cycle is None or self.cycle.response_complete
        if waiting and self.deadline is None:
            self._close_later()
        super().data_received(data)
        if self.cycle is not None and not self.cycle.response_complete:
            self._cancel_deadline()

    def pause_writing(self) -> None:
        """Wait for a client that reads slowly."""
        super().pause_writing()
        self._close_later()

    def resume_writing(self) -> None:
        """The client has read."""
        super().resume_writing()
        self._cancel_deadline()

    def connection_lost(self, exc: Exception | None) -> None:
        """End all waiting."""
        self._cancel_deadline()
        super().connection_lost(exc)

    def send_400_response(self, msg: str) -> None:
        """Answer bytes that are no HTTP request, and close the connection."""
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):  # otherwise a response has begun
            id = request_ids.request_id("")
            body = malformed_request(id).model_dump_json(exclude_defaults=True).encode()
            headers = [("Content-Type", MEDIA_TYPE), ("Content-Length", str(len(body))), ("Connection", "close"),
                       (request_ids.HEADER, id)]
            for event in (h11.Response(status_code=400, headers=headers), h11.Data(data=body), h11.EndOfMessage()):
                self.transport.write(self.conn.send(event) or b"")
        self.transport.close()

    def _close_later(self) -> None:
        self._cancel_deadline()
        # `abort`, because `close` would wait until the client has read what is written.
        self.deadline = self.loop.call_later(self.seconds, self.transport.abort)

    def _cancel_deadline(self) -> None:
        if self.deadline is not None:
            self.deadline.cancel()
            self.deadline = None
