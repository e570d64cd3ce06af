"""A PostgreSQL server of the tests' own: a folder, a port of the loopback address, and a user with a password."""

import os
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path

import psycopg

USER, PASSWORD = "slipstick", "correct-horse"
MISSING = "PostgreSQL is missing: apt-get update && apt-get install -y postgresql"


def program(name: str) -> str | None:
    """The path of a program of PostgreSQL, also where it is not on the search path, as in Debian."""
    installed = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{name}"))
    return shutil.which(name) or (str(installed[-1]) if installed else None)


class Server:
    """A server that can be killed and started again on the same data."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="slipstick-postgresql-"))
        # The server refuses to run as root, so that it then runs as the user `postgres`.
        self.user = {"user": "postgres", "group": "postgres", "extra_groups": ()} if os.geteuid() == 0 else {}
        if self.user:
            shutil.chown(self.folder, "postgres", "postgres")
        password = self.folder / "password"
        password.write_text(PASSWORD)
        password.chmod(0o644)
        subprocess.run([str(program("initdb")), "--no-sync", "--username", USER, "--auth", "scram-sha-256",
                        "--pwfile", str(password), "--pgdata", str(self.folder / "data")], check=True,
                       stdout=subprocess.DEVNULL, cwd=self.folder, **self.user)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.start()

    def url(self, database: str, password: str = PASSWORD) -> str:
        """The URL of a database, which is created if it does not exist."""
        with self.connected("postgres") as connection:
            if not connection.execute("SELECT 1 FROM pg_database WHERE datname = %s", [database]).fetchall():
                connection.execute(f'CREATE DATABASE "{database}"')
        return f"postgresql://{USER}:{password}@127.0.0.1:{self.port}/{database}"

    def connected(self, database: str) -> psycopg.Connection:
        return psycopg.connect(host="127.0.0.1", port=self.port, user=USER, password=PASSWORD, dbname=database,
                               autocommit=True)

    def launch(self) -> subprocess.Popen[bytes]:
        with (self.folder / "log").open("ab") as log:
            self.process = subprocess.Popen(
                [str(program("postgres")), "-D", str(self.folder / "data"), "-p", str(self.port), "-k",
                 str(self.folder), "-c", "listen_addresses=127.0.0.1"], stdout=log, stderr=log, cwd=self.folder,
                **self.user)
        return self.process

    def start(self) -> None:
        self.launch()
        while True:
            try:
                return self.connected("postgres").close()
            except psycopg.OperationalError:
                assert self.process.poll() is None, (self.folder / "log").read_text()
                time.sleep(0.05)

    def kill(self) -> None:
        """End the server as a crash does, with all its connections."""
        self.process.send_signal(signal.SIGQUIT)
        self.process.wait()

    def remove(self) -> None:
        self.kill()
        shutil.rmtree(self.folder)
