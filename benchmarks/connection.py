"""A connection that is kept alive, with as little work of the client as possible between the bytes of two requests."""

import socket
from types import TracebackType
from typing import Self


class Connection:
    """HTTP/1.1 to a port of this machine; answers need a Content-Length."""

    def __init__(self, port: int) -> None:
        self.port = port
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.socket.close()

    def request(self, path: str, body: bytes = b"", headers: str = "", method: str = "POST") -> bytes:
        """The bytes of a request."""
        return (f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\nContent-Length: {len(body)}\r\n"
                f"{headers}\r\n").encode() + body

    def exchange(self, request: bytes) -> memoryview:
        """Send a request and return the body of its answer, which must have status 200."""
        self.socket.sendall(request)
        received = bytearray()
        while (end := received.find(b"\r\n\r\n")) < 0:
            received += self._some(65536)
        head = bytes(received[:end]).lower()
        assert head.startswith(b"http/1.1 200 "), bytes(received[:2000])
        size = int(head.partition(b"content-length: ")[2].partition(b"\r\n")[0])
        body = memoryview(bytearray(size))
        filled = len(received) - end - 4
        body[:filled] = received[end + 4:]
        while filled < size:
            count = self.socket.recv_into(body[filled:])
            assert count, "the connection closed before the end of the answer"
            filled += count
        return body

    def _some(self, size: int) -> bytes:
        part = self.socket.recv(size)
        assert part, "the connection closed before the answer"
        return part
