"""The servers of `benchmarks.serving`: the service on the default table, a bare Starlette server, and UM-Bridge's."""

import os
import socket
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

ROOT = Path(__file__).parents[1]


class Connection:
    """HTTP/1.1 to a port of this machine, kept alive, with little work of the client; answers need a Content-Length."""

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
            received += self._receive(65536)
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

    def _receive(self, size: int) -> bytes:
        part = self.socket.recv(size)
        assert part, "the connection closed before the answer"
        return part


@dataclass(frozen=True, eq=False)
class Server:
    """A process that listens on a port of this machine."""

    process: subprocess.Popen[bytes]
    port: int

    def connect(self) -> Connection:
        """A connection, as soon as the server takes one."""
        while True:
            with suppress(ConnectionRefusedError):
                return Connection(self.port)
            assert self.process.poll() is None, "the server has ended"
            time.sleep(0.002)

    def memory(self, of: str = "VmRSS") -> float:
        """Resident set in MB (1e6 bytes), or another entry of the status of the process."""
        lines = Path(f"/proc/{self.process.pid}/status").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith(f"{of}:")) * 1024 / 1e6

    def processor_seconds(self) -> float:
        """Processor time of all threads so far, in steps of 0.01 s."""
        user, system = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
        return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")

    def end(self) -> None:
        """End the process."""
        self.process.terminate()
        self.process.wait()


def service(tables: Path) -> Server:
    """`python -m service` on the folder `tables`."""
    port = _free_port()
    environment = {**os.environ, "SLIPSTICK_TABLES": str(tables), "SLIPSTICK_PORT": str(port),
                   "SLIPSTICK_JOBS": f"sqlite:///{tables.parent}/jobs.sqlite"}
    return _start(port, environment, "service")


def bare(answers: Path, table: Path) -> Server:
    """A Starlette server whose routes return the files of the folder `answers`, and /least points of this table."""
    port = _free_port()
    return _start(port, dict(os.environ), "benchmarks.bare_server", str(port), str(answers), str(table))


def umbridge(table: Path) -> Server:
    """The Python server of UM-Bridge with this table."""
    port = _free_port()
    return _start(port, dict(os.environ), "benchmarks.umbridge_server", str(port), str(table))


def _start(port: int, environment: dict[str, str], *arguments: str) -> Server:
    return Server(subprocess.Popen([sys.executable, "-m", *arguments], cwd=ROOT, env=environment,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL), port)


def _free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])
