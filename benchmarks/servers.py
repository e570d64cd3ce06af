"""The servers of `benchmarks.serving`: the service on the default table, a bare Starlette server, and UM-Bridge's."""

import os
import socket
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from benchmarks.connection import Connection

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True, eq=False)
class Server:
    """A process that listens on a port of this machine."""

    process: subprocess.Popen[bytes]
    port: int

    def connected(self) -> Connection:
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
    return _started(port, environment, "service")


def bare(answers: Path, table: Path) -> Server:
    """A Starlette server whose routes return the files of the folder `answers`, and /least points of this table."""
    port = _free_port()
    return _started(port, dict(os.environ), "benchmarks.bare_server", str(port), str(answers), str(table))


def umbridge(table: Path) -> Server:
    """The Python server of UM-Bridge with this table."""
    port = _free_port()
    return _started(port, dict(os.environ), "benchmarks.umbridge_server", str(port), str(table))


def _started(port: int, environment: dict[str, str], *arguments: str) -> Server:
    return Server(subprocess.Popen([sys.executable, "-m", *arguments], cwd=ROOT, env=environment,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL), port)


def _free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])
