"""Writes the recordings of a list of cases, and apart from them their truth.

    python -m tests.validation.hidden DIRECTORY LIST [id ...] [--truth FILE]

LIST is one of cases.py, such as final.
"""

import argparse
import json
from pathlib import Path

from .cases import LISTS
from .files import write
from .truths import truth


def main(arguments: list[str] | None = None) -> None:
    """Write those files of the list that do not exist, and the truth of all of them."""
    parser = argparse.ArgumentParser(prog="python -m tests.validation.hidden", description=__doc__)
    parser.add_argument("directory", type=Path)
    parser.add_argument("list", choices=LISTS)
    parser.add_argument("ids", nargs="*", help="of cases, all if none is given")
    parser.add_argument("--truth", type=Path, help="file of the truth (default: DIRECTORY/truth.json)")
    given = parser.parse_args(arguments)
    cases, path = LISTS[given.list], given.truth or given.directory / "truth.json"
    if unknown := set(given.ids) - set(cases):
        parser.error(f"no such case: {', '.join(sorted(unknown))}")
    given.directory.mkdir(parents=True, exist_ok=True)
    truths = json.loads(path.read_text()) if path.exists() else {}
    for name in given.ids or cases:
        file = given.directory / f"{name}.h5"
        if file.exists() and name in truths:
            continue
        part = file.with_suffix(".part")
        write(part, cases[name])
        truths[name] = truth(cases[name])
        path.write_text(json.dumps(truths))
        part.rename(file)


if __name__ == "__main__":
    main()
