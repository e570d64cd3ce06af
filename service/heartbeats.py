"""How many workers are alive, by the heartbeats that they write (worker/heartbeat.py)."""

from dataclasses import dataclass

from sqlalchemy import Engine, inspect, text

from slipstick.storage.database import clock

_TABLE = "slipstick_workers"
DEAD_SECONDS = 5.0


@dataclass(eq=False)
class Heartbeats:
    """The heartbeats in the job database."""

    engine: Engine
    _exist: bool = False

    def alive(self) -> int:
        """Return the number of workers with a heartbeat in the last 5 s."""
        self._exist = self._exist or inspect(self.engine).has_table(_TABLE)
        if not self._exist:  # no worker has ever run
            return 0
        with self.engine.connect() as connection:
            count: int = connection.execute(text(
                f"SELECT count(*) FROM {_TABLE} WHERE seen >= {clock(self.engine)} - {DEAD_SECONDS}")).scalar_one()
        return count
