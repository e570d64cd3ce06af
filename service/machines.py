"""The machines that workers have told of in the job database (worker/known_machines.py). No file of them is run."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any

from fastapi import Depends, Request
from sqlalchemy import Engine, inspect, text

from slipstick.black_box.known import KnownMachine
from slipstick.errors import UnknownName
from slipstick.storage.database import clock

from .heartbeats import DEAD_SECONDS

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


@dataclass(eq=False)
class Machines:
    """The machines in the job database."""

    engine: Engine
    _exist: bool = False

    def read_all(self) -> list[StoredMachine]:
        """Return all machines by their names."""
        return self._select("", {})

    def find(self, name: str) -> StoredMachine:
        """Return a machine; raises `UnknownName`."""
        for each in self._select("WHERE name = :name", {"name": name}):
            return each
        raise UnknownName.of("machine", name, [each.name for each in self.read_all()])

    def _select(self, condition: str, values: dict[str, Any]) -> list[StoredMachine]:
        self._exist = self._exist or inspect(self.engine).has_table("slipstick_machine_workers")
        if not self._exist:  # no worker has ever told of machines
            return []
        with self.engine.connect() as connection:
            rows = connection.execute(text(f"{_SELECT.format(now=clock(self.engine))} {condition} ORDER BY name"),
                                      values)
            return [StoredMachine(row.name, row.workers, row.content) for row in rows]


@lru_cache(maxsize=64)
def _read(content: str) -> KnownMachine:
    return KnownMachine.from_json(content)


async def _machines(request: Request) -> Machines:
    machines: Machines = request.app.state.machines
    return machines


MachinesDependency = Annotated[Machines, Depends(_machines)]
