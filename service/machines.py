"""The machines that workers have told of in the job database (worker/known_machines.py). No file of them is run."""

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

from sqlalchemy import Engine, inspect, text

from slipstick.black_box.known import KnownMachine
from slipstick.errors import UnknownName
from slipstick.storage.database import clock

from .heartbeats import DEAD_SECONDS
from .held import held

_SELECT = f"""SELECT name, content, (SELECT count(*) FROM slipstick_machine_workers
JOIN slipstick_workers ON slipstick_workers.name = worker
WHERE machine = slipstick_machines.name AND seen >= {{now}} - {DEAD_SECONDS}) AS workers
FROM slipstick_machines"""


@dataclass(frozen=True)
class StoredMachine:
    """A machine by its `name`, with the number of running `workers` that have its file."""

    name: str
    workers: int
    content: str

    @property
    def known(self) -> KnownMachine:
        """What is told of it; raises `InvalidValue` where that cannot be read."""
        return _read(self.content)

    @property
    def digest(self) -> str:
        """SHA-256 of what is told of it."""
        return hashlib.sha256(self.content.encode()).hexdigest()


@dataclass(eq=False)
class Machines:
    """The machines in the job database."""

    engine: Engine
    _exist: bool = False

    def read_all(self) -> list[StoredMachine]:
        """Return all machines by their names."""
        return self._select()

    def get(self, name: str) -> StoredMachine | None:
        """Return a machine, None where no worker has told of it."""
        return next(iter(self._select(name)), None)

    def find(self, name: str) -> StoredMachine:
        """Return a machine; raises `UnknownName`."""
        if (stored := self.get(name)) is None:
            raise UnknownName.of("machine", name, [each.name for each in self.read_all()])
        return stored

    def has_worker(self, name: str) -> bool:
        """Whether a running worker has a machine."""
        return (stored := self.get(name)) is not None and stored.workers > 0

    def _select(self, name: str | None = None) -> list[StoredMachine]:
        self._exist = self._exist or inspect(self.engine).has_table("slipstick_machine_workers")
        # No worker has ever told of machines; and a server refuses texts with a NUL.
        if not self._exist or not (name or "").isprintable():
            return []
        query = _SELECT.format(now=clock(self.engine)) + (" ORDER BY name" if name is None else " WHERE name = :name")
        with self.engine.connect() as connection:
            return [StoredMachine(row.name, row.workers, row.content)
                    for row in connection.execute(text(query), {} if name is None else {"name": name})]


def tell_missing(machine: str) -> str:
    """Return what to do where no running worker has a machine that a job needs."""
    return (f"No running worker has the machine “{machine}”. The job waits until one is started with its file: "
            "slipstick work --machine FILE")


@lru_cache(maxsize=64)
def _read(content: str) -> KnownMachine:
    return KnownMachine.from_json(content)


MachinesDependency = Annotated[Machines, held("machines")]
