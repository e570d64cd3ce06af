"""Output of results: one CSV file per benchmark, whose last row is the command that produced it."""

import csv
import platform
from collections.abc import Iterable, Sequence
from pathlib import Path

from llvmlite import binding


def write(name: str, header: Sequence[str], rows: Iterable[Sequence[object]], made_by: str) -> None:
    """Write the table to benchmarks/NAME.csv and print it."""
    path = Path(__file__).with_name(f"{name}.csv")
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(header)
        for row in rows:
            table.writerow([f"{entry:.4g}" if isinstance(entry, float) else entry for entry in row])
        table.writerow([f"made by `{made_by}`: {describe_machine()}", *[""] * (len(header) - 1)])
    print(path.read_text())


def describe_machine() -> str:
    """Return the processor and Python of this process."""
    return f"{platform.machine()} ({binding.get_host_cpu_name()}), Python {platform.python_version()}"
