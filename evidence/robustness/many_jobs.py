"""What the service takes for lists, pages and metrics with ten thousand jobs in its store.

    python -m benchmarks.many_jobs [--jobs JOBS]

The service runs on a temporary folder with the table and recordings of benchmarks.kills and SQLite. One fit is run; its
rows in the job database are then copied under other ids: of each hundred 80 are done, 10 have failed, 8 were cancelled,
and 2 wait. One client sends each request 20 times, before and after. Times are medians that the client sees.
"""

import argparse
import sqlite3
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

import numpy as np

from benchmarks.load import SMALL, prepared
from benchmarks.results import write
from benchmarks.supervised import Stack, prepare

HEADER = ("request", "one job [ms]", "many jobs [ms]", "size with many [kB]")
REQUESTS = ("/v1/health", "/metrics", "/", "/?count=100", "/v1/fits", "/v1/fits?offset=9000", "/v1/fits?limit=1000",
            "/v1/fits?format=csv", "/v1/fits?status=failed", "/v1/fits?recordings=few", "/v1/fits?table=small",
            "/v1/fits?since=2020-01-01", "/v1/fits/finished", "/v1/studies", "/v1/tables", "/v1/recordings")
_REPEATED = 20
_OTHER = {8: "ERROR", 9: "CANCELLED"}
"""State of the copies by the tens of their numbers; all others are done, except for two of each hundred, which wait."""


def fill(database: Path, jobs: int) -> None:
    """Copy the rows of the fit `finished` under `jobs` - 1 other ids, a minute apart."""
    with closing(sqlite3.connect(database, timeout=60)) as connection, connection:
        for table in ("workflow_status", "workflow_input", "workflow_output"):
            columns = [row[1] for row in connection.execute(f"PRAGMA table_info({table})")]
            source = connection.execute(f"SELECT * FROM {table} WHERE workflow_uuid = 'finished'").fetchone()
            rows = (_copy(dict(zip(columns, source, strict=True)), number) for number in range(1, jobs))
            connection.executemany(f"INSERT INTO {table} VALUES ({', '.join('?' * len(columns))})",
                                   (tuple(row.values()) for row in rows))


def _copy(row: dict[str, object], number: int) -> dict[str, object]:
    state = "ENQUEUED" if number % 100 >= 98 else _OTHER.get(number % 100 // 10, "SUCCESS")
    changed: dict[str, object] = {"workflow_uuid": f"copy-{number}"}
    if "status" in row:
        changed |= {"status": state, "queue_name": "short"}
        changed |= {name: int(str(row[name])) - 60_000 * number for name in ("created_at", "completed_at")}
        if state == "ENQUEUED":
            changed |= {"completed_at": None, "started_at_epoch_ms": None}
    return row | changed


def milliseconds(stack: Stack, path: str) -> tuple[float, int]:
    """Median time of a request, and the size of its response in bytes."""
    seconds = []
    for _ in range(_REPEATED):
        begin = time.perf_counter()
        response = stack.client.get(path, timeout=60).raise_for_status()
        seconds.append(time.perf_counter() - begin)
    return 1e3 * float(np.median(seconds)), len(response.content)


def main() -> int:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--jobs", type=int, default=10_000)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="slipstick-many-") as folder, tempfile.TemporaryFile("w") as log:
        prepare(Path(folder), SMALL)
        stack = Stack(Path(folder), None, log)
        try:
            prepared(stack)
            few = [milliseconds(stack, path)[0] for path in REQUESTS]
            fill(Path(folder) / "sqlite.sqlite", arguments.jobs)
            many = [milliseconds(stack, path) for path in REQUESTS]
        finally:
            stack.end()
    rows = [(path, before, after, size / 1e3) for path, before, (after, size) in zip(REQUESTS, few, many, strict=True)]
    write("many_jobs", HEADER, rows, f"python -m benchmarks.many_jobs --jobs {arguments.jobs}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
