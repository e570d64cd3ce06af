"""Committed results: one small CSV each, its last line the command that made it."""

import csv
import platform
from collections.abc import Iterable, Sequence
from pathlib import Path


def write(name: str, header: Sequence[str], rows: Iterable[Sequence[object]], made_by: str) -> None:
    """Put the table at benchmarks/NAME.csv and print it."""
    path = Path(__file__).with_name(f"{name}.csv")
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(header)
        for row in rows:
            table.writerow([f"{entry:.4g}" if isinstance(entry, float) else entry for entry in row])
        machine = platform.processor() or platform.machine()
        table.writerow([f"made by `{made_by}`: {machine}, Python {platform.python_version()}",
                        *[""] * (len(header) - 1)])
    print(path.read_text())
