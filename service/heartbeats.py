"""How many workers are alive, by the heartbeats that they write (worker/heartbeat.py)."""

from dataclasses import dataclass

from sqlalchemy import Engine, inspect, text

from slipstick.storage.database import clock, open_database

_TABLE = "slipstick_workers"
_DEAD_SECONDS = 5.0


@dataclass(frozen=True, eq=False)
class Heartbeats:
    """The heartbeats in the job database."""

    engine: Engine

    @classmethod
    def at(cls, url: str) -> "Heartbeats":
        """The heartbeats in the database at `url`."""
        return cls(open_database(url))

    def alive(self) -> int:
        """Return the number of workers with a heartbeat in the last 5 s."""
        if not inspect(self.engine).has_table(_TABLE):  # no worker has ever run
            return 0
        with self.engine.connect() as connection:
            count: int = connection.execute(text(
                f"SELECT count(*) FROM {_TABLE} WHERE seen >= {clock(self.engine)} - {_DEAD_SECONDS}")).scalar_one()
        return count
