"""A worker tells the service which machines it has, in two tables of the job database (service/machines.py).

The description of a machine stays when all workers that have its file are gone.
"""

import sys
from collections.abc import Sequence

from sqlalchemy import Engine, text

from slipstick.black_box.known import LONGEST_NAME, KnownMachine
from slipstick.errors import InvalidValue
from slipstick.storage.database import clock, create_tables

_TABLES = (
    f"CREATE TABLE IF NOT EXISTS slipstick_machines (name VARCHAR({LONGEST_NAME}) PRIMARY KEY, content TEXT NOT NULL, "
    "told DOUBLE PRECISION NOT NULL)",
    f"CREATE TABLE IF NOT EXISTS slipstick_machine_workers (machine VARCHAR({LONGEST_NAME}), worker VARCHAR(255), "
    "PRIMARY KEY (machine, worker))")
_WRITE = """INSERT INTO slipstick_machines (name, content, told) VALUES (:name, :content, {now})
ON CONFLICT (name) DO UPDATE SET content = excluded.content, told = excluded.told"""


def tell(engine: Engine, worker: str, machines: Sequence[KnownMachine]) -> None:
    """Write the descriptions of the `machines`, and that this worker, whose heartbeat is written, has these alone.

    One that cannot be written is left out, with a line on the error output. `machines` are in the order of their names.
    """
    create_tables(engine, *_TABLES)
    contents = dict[str, str]()
    for each in machines:
        try:
            contents[each.name] = each.to_json()
        except InvalidValue as error:
            print(f"The service is not told of the machine '{each.name[:60]}': {error}", file=sys.stderr, flush=True)
    with engine.begin() as connection:
        connection.execute(text("DELETE FROM slipstick_machine_workers WHERE worker = :worker OR worker NOT IN "
                                "(SELECT name FROM slipstick_workers)"), {"worker": worker})
        for name, content in contents.items():
            connection.execute(text(_WRITE.format(now=clock(engine))), {"name": name, "content": content})
            connection.execute(text("INSERT INTO slipstick_machine_workers (machine, worker) VALUES (:machine, :worker)"
                                    ), {"machine": name, "worker": worker})
