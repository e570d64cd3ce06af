"""The lock on the name of a worker: two of the same name would restart each other's jobs."""

import fcntl
import hashlib
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import Connection, Engine, text
from sqlalchemy.exc import SQLAlchemyError

from slipstick.errors import InvalidValue

NAME = r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,99}"


@contextmanager
def locked_name(name: str, engine: Engine, file: Path | None) -> Iterator[Callable[[], bool]]:
    """Hold the lock on `name`, beside the `file` of the database or on its server; yield whether it is still held.

    The lock ends with this process however it ends.
    Raises `InvalidValue` if another worker has the name, or for one that is no name of a file.
    """
    if not re.fullmatch(NAME, name):
        raise InvalidValue(f"'{name}' is no name of a worker",
                           "Give up to 100 letters, digits, dots, underscores and hyphens, the first no dot")
    if file is None:
        lock = _ServerLock(engine, name)
        try:
            if not lock.is_held():
                raise _in_use(name)
            yield lock.is_held
        finally:
            lock.release()
        return
    with (file.parent / f"slipstick-{file.stem}-{name}.lock").open("w") as opened:
        try:
            fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise _in_use(name) from None
        yield lambda: True


@dataclass(eq=False)
class _ServerLock:
    """An advisory lock of the server, which it releases when the connection ends, as with a restart of the server."""

    engine: Engine
    name: str
    _connection: Connection | None = None

    def is_held(self) -> bool:
        """Ask for the lock, which a connection that has it gets again; raises `SQLAlchemyError`."""
        if self._connection is None:
            self._connection = self.engine.connect().execution_options(isolation_level="AUTOCOMMIT")
            self._connection.detach()  # of its pool, which would keep the connection, and with it the lock
        key = int.from_bytes(hashlib.sha256(f"slipstick worker {self.name}".encode()).digest()[:8], signed=True)
        try:
            return bool(self._connection.execute(text("SELECT pg_try_advisory_lock(:key)"), {"key": key}).scalar_one())
        except SQLAlchemyError:
            self.release()
            raise

    def release(self) -> None:
        """End the connection."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None


def _in_use(name: str) -> InvalidValue:
    return InvalidValue(f"A worker named '{name}' is already running", "Stop it, or give this worker another --name")
