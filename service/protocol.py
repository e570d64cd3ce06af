"""HTTP/1.1 connections: bytes that are no HTTP request are answered with problem details as well."""

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.problem_details import MEDIA_TYPE, malformed_request


class Connection(H11Protocol):
    """A connection of uvicorn whose protocol errors are problem details."""

    def send_400_response(self, msg: str) -> None:
        """Answer bytes that are no HTTP request, and close the connection."""
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):  # otherwise a response has begun
            body = malformed_request().model_dump_json(exclude_defaults=True).encode()
            headers = [("Content-Type", MEDIA_TYPE), ("Content-Length", str(len(body))), ("Connection", "close")]
            for event in (h11.Response(status_code=400, headers=headers), h11.Data(data=body), h11.EndOfMessage()):
                self.transport.write(self.conn.send(event) or b"")
        self.transport.close()
