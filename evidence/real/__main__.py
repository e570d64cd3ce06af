"""Answer real recordings, and replace the rows of their machines in the table."""

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported

from evidence import real
from evidence.real import emps
from evidence.tables import replace_rows
from slipstick.engine.selection import identify

TABLE = Path(__file__).parents[1] / "real.csv"
HEADER = "machine", "what", "value", "standard error", "unit", "published"
MACHINES: dict[str, ModuleType] = {"emps": emps}
"""The folder of each machine, and its module: its declaration, how its recordings are read, and what is known."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Answer the recordings of the machines that the command names, or of all."""
    parser = argparse.ArgumentParser(prog="python -m evidence.real", description=(real.__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, help="folder with a folder of recordings for each machine")
    parser.add_argument("machines", nargs="*", metavar="MACHINE", help=f"by default all of {', '.join(MACHINES)}")
    chosen = parser.parse_args(arguments)
    if unknown := set(chosen.machines) - set(MACHINES):
        parser.error(f"{', '.join(sorted(unknown))} is none of {', '.join(MACHINES)}")
    for name in chosen.machines or MACHINES:
        machine = MACHINES[name]
        answer = identify(machine.read(chosen.folder / name), log=print)
        rows = [[f"named: {' over '.join(finding.pair)}", f"{finding.nats:.0f}", "", "nats", ""]
                for finding in answer.findings]
        rows += [[f"unexplained: {block}", "", "", "", ""] for block in answer.unexplained]
        rows += [[row.what, f"{row.value:.4g}", f"{row.error:.2g}", row.unit, f"{row.published:.4g}"]
                 for row in machine.compare(answer)]
        replace_rows(TABLE, HEADER, name, rows)


if __name__ == "__main__":
    main()
