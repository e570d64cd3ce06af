"""A service, two workers and their job database in a temporary folder, each started again whenever it has ended."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TextIO

import httpx
import numpy as np

from slipstick.recordings import Recordings
from tests.postgresql import Server

ROOT = Path(__file__).parents[2]
_SMALL = ("--axis", "pressure_bias=0.5:1.5:9", "--axis", "initial_position=0.5:1.5:9")
_PAUSE = 0.5
Process = subprocess.Popen[bytes]


class Program:
    """A process that is started again when it has ended, as a supervisor does."""

    def __init__(self, start: Callable[[], Process]) -> None:
        self.start, self.process = start, start()
        self.starts_at: float | None = None

    def kill(self, pause: float) -> None:
        """Send SIGKILL; the process is started again after `pause` s."""
        self.process.kill()
        self.process.wait()
        self.starts_at = time.monotonic() + pause

    def keep(self) -> None:
        """Start the process again if it has ended."""
        if self.process.poll() is None:
            return
        if self.starts_at is None:  # it ended by itself, such as a worker that finds no database at its start
            self.starts_at = time.monotonic() + _PAUSE
        if time.monotonic() >= self.starts_at:
            self.process, self.starts_at = self.start(), None


class Stack:
    """Service, workers and job database on a folder that `write_tables` has filled; SQLite without a `server`."""

    def __init__(self, folder: Path, server: Server | None, log: TextIO) -> None:
        self.folder, self.log, self.server = folder, log, server
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        jobs = server.url("kills") if server else f"sqlite:///{self.database}"
        self.environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "SLIPSTICK_PORT": str(port),
                            "SLIPSTICK_TABLES": str(folder / "tables"), "SLIPSTICK_JOBS": jobs}
        self.client = httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=10)
        self.programs = {"service": Program(lambda: self.start("service"))}
        for worker in ("worker-1", "worker-2"):
            self.programs[worker] = Program(lambda name=worker: self.start("worker", "work", "--name", name))
        if server:
            self.programs["database"] = Program(lambda: self._restart(server))

    @property
    def database(self) -> Path:
        """The file of the jobs in SQLite."""
        return self.folder / "jobs.sqlite"

    def start(self, *arguments: str) -> Process:
        """Start `python -m ...`."""
        return subprocess.Popen([sys.executable, "-m", *arguments], cwd=ROOT, env=self.environment, stdout=self.log,
                                stderr=self.log)

    def keep(self) -> None:
        """Start each program again that has ended."""
        for program in self.programs.values():
            program.keep()

    def end(self) -> None:
        """Kill service and workers; the database server belongs to the caller."""
        for name, program in self.programs.items():
            if name != "database":
                program.process.kill()
                program.process.wait()
        self.client.close()

    @staticmethod
    def _restart(server: Server) -> Process:
        return server.process if server.process.poll() is None else server.launch()


def write_tables(folder: Path) -> None:
    """Write the bench, every ninth of the shipped recordings, `few`, and a table, `small`, into `folder`/tables."""
    tables = folder / "tables"
    tables.mkdir()
    (tables / "heavy.toml").write_bytes((ROOT / "tables" / "heavy.toml").read_bytes())
    shipped = Recordings.open(ROOT / "tables" / "measured.h5")
    few = shipped.take(np.arange(0, len(shipped), 9))
    order = np.argsort(np.argsort(few.conditions.run_order))
    few = replace(few, conditions=replace(few.conditions, run_order=order))
    (tables / "few.h5").write_bytes(few.to_bytes())
    subprocess.run([sys.executable, "-m", "worker", "build", *_SMALL, "--conditions", str(tables / "few.h5"), "--out",
                    str(tables / "small.h5")], cwd=ROOT, check=True)
