"""What the service takes for lists, pages and metrics with ten thousand jobs in its store.

    python -m evidence.robustness.many_jobs [--jobs JOBS]

The service runs on a temporary folder with a small table, 24 recordings, and SQLite. One fit is run; its rows in the
job database are then copied under other ids: of each hundred 80 are done, 10 have failed, 8 were cancelled, and 2 wait.
One client sends each request 20 times, before and after. Times are medians that the client sees; a row with several
requests has the least and the largest of them. A minute.
"""

import argparse
import sqlite3
import tempfile
import time
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

from evidence.robustness.load import finish_a_fit
from evidence.robustness.supervised import Stack, write_tables
from evidence.robustness.table import Row, replace_rows

REQUESTS = {
    "health": ("/v1/health",),
    "metrics": ("/metrics",),
    "front page": ("/",),
    "front page with 100 jobs of each kind": ("/?count=100",),
    "lists of fits, plain, filtered or as CSV": (
        "/v1/fits", "/v1/fits?offset=9000", "/v1/fits?format=csv", "/v1/fits?status=failed", "/v1/fits?recordings=few",
        "/v1/fits?table=small", "/v1/fits?since=2020-01-01"),
    "list of 1,000 fits": ("/v1/fits?limit=1000",),
    "one fit": ("/v1/fits/finished",),
    "lists of studies, tables and recordings": ("/v1/studies", "/v1/tables", "/v1/recordings"),
}
_REPEATS = 20
_OTHER = {8: "ERROR", 9: "CANCELLED"}
"""State of the copies by the tens of their numbers; all others are done, except for two of each hundred, which wait."""


def copy_fit(database: Path, jobs: int) -> None:
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
    changes: dict[str, object] = {"workflow_uuid": f"copy-{number}"}
    if "status" in row:
        changes |= {"status": state, "queue_name": "short"}
        changes |= {name: int(str(row[name])) - 60_000 * number for name in ("created_at", "completed_at")}
        if state == "ENQUEUED":
            changes |= {"completed_at": None, "started_at_epoch_ms": None}
    return row | changes


def time_request(stack: Stack, path: str) -> tuple[float, float]:
    """Median time of a request in ms, and the size of its response in kB."""
    seconds = []
    for _ in range(_REPEATS):
        begin = time.perf_counter()
        response = stack.client.get(path, timeout=60).raise_for_status()
        seconds.append(time.perf_counter() - begin)
    return 1e3 * float(np.median(seconds)), len(response.content) / 1e3


def describe(what: str, few: list[tuple[float, float]], many: list[tuple[float, float]]) -> Row:
    """The row of some requests, from their times and sizes with one job and with many."""
    (one_job, _), (many_jobs, sizes) = (zip(*measurements, strict=True) for measurements in (few, many))
    count = len(few) * 2 * _REPEATS
    return Row(what, count, count, "requests", f"{_range(one_job)} ms with one job, {_range(many_jobs)} ms with many "
                                               f"({_range(sizes)} kB)")


def _range(values: Sequence[float]) -> str:
    least, most = f"{min(values):.4g}", f"{max(values):.4g}"
    return least if least == most else f"{least} to {most}"


def main() -> None:
    """Measure, and replace the rows of the table."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--jobs", type=int, default=10_000)
    jobs = parser.parse_args().jobs
    with tempfile.TemporaryDirectory(prefix="slipstick-many-") as folder, tempfile.TemporaryFile("w") as log:
        write_tables(Path(folder))
        stack = Stack(Path(folder), None, log)
        try:
            finish_a_fit(stack)
            few = {what: [time_request(stack, path) for path in paths] for what, paths in REQUESTS.items()}
            copy_fit(stack.database, jobs)
            many = {what: [time_request(stack, path) for path in paths] for what, paths in REQUESTS.items()}
        finally:
            stack.end()
    replace_rows("many jobs", [describe(what, few[what], many[what]) for what in REQUESTS],
                 f"python -m evidence.robustness.many_jobs --jobs {jobs}")


if __name__ == "__main__":
    main()
