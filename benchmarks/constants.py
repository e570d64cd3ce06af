"""Which constants of the naming decide answers: each is halved and doubled, and fixed cases are answered anew.

    python -m benchmarks.constants [CASES [PROCESSES [ENGAGEMENTS [MODULE.NAME ...]]]]

Constants are the numbers, and tuples and arrays of numbers, that the modules of slipstick/blocks and slipstick/naming
assign to names in capitals, and the fields of `NamingSettings`. A module with another value is compiled from its
changed source, so that defaults of functions change as well, and its kernels anew. Every finished sweep is a line of
var/constants.jsonl; constants.csv counts changed answers: other findings, or other blocks unexplained. The cases are
at equal distances in the development list of those with at most 54 engagements and one hidden effect at most; of each,
ENGAGEMENTS at equal distances are used. With names, such as settings.knots or naming.selection.NEAR, only these
constants are swept, and the table keeps its rows of the others.
"""

import ast
import csv
import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from importlib.machinery import SourceFileLoader
from importlib.util import spec_from_file_location
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from types import CodeType, ModuleType
from typing import Any

import numba
import numpy as np

from benchmarks.results import write
from slipstick.naming.settings import NamingSettings
from tests.validation.hidden import cases

PACKAGE = Path(__file__).parents[1] / "slipstick"
LINES, TABLE = Path("var/constants.jsonl"), Path(__file__).with_suffix(".csv")
FACTORS = (1.0, 0.5, 2.0)
Constant = tuple[str, str]
"""A module of slipstick, or "settings", and a name in it."""


def constants() -> list[Constant]:
    """All of them."""
    found = [("settings", name) for name in asdict(NamingSettings())]
    for package in ("blocks", "naming"):
        for file in sorted((PACKAGE / package).glob("*.py")):
            tree = ast.parse(file.read_text())
            found += [(f"{package}.{file.stem}", name) for node in tree.body for name in _assigned(node)]
    return found


def _source(constant: Constant) -> Path:
    """The file of its module."""
    return PACKAGE.joinpath(*constant[0].split(".")).with_suffix(".py")


def _assigned(node: ast.stmt) -> list[str]:
    """Names in capitals that an assignment gives numbers to."""
    if not isinstance(node, ast.Assign) or not _has_number(node.value):
        return []
    names = node.targets[0].elts if isinstance(node.targets[0], ast.Tuple) else node.targets
    return [one.id for one in names if isinstance(one, ast.Name) and one.id.isupper()]


def _has_number(node: ast.expr) -> bool:
    """Whether an expression consists of numbers, perhaps as an array."""
    if isinstance(node, ast.Call) and ast.unparse(node.func) == "np.array":
        return all(map(_has_number, node.args))
    numbers = (ast.Tuple, ast.List, ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop, ast.Load)
    return all(isinstance(one.value, int | float) if isinstance(one, ast.Constant) else isinstance(one, numbers)
               for one in ast.walk(node))


class _Scaled(SourceFileLoader):
    """Loads a module in which one constant is multiplied; whole numbers stay whole, and at least 1."""

    name: str
    factor: float

    def get_code(self, fullname: str) -> CodeType:
        """The code of the changed module."""
        tree = ast.parse(Path(self.path).read_text())
        for node in tree.body:
            if self.name in _assigned(node):
                assert isinstance(node, ast.Assign)
                self._scale(node)
        return compile(ast.fix_missing_locations(tree), self.path, "exec")

    def _scale(self, node: ast.Assign) -> None:
        value: ast.expr = node.value
        if isinstance(node.targets[0], ast.Tuple):
            assert isinstance(node.value, ast.Tuple)
            place = [one.id for one in node.targets[0].elts if isinstance(one, ast.Name)].index(self.name)
            value = node.value.elts[place]
        for one in ast.walk(value):
            if isinstance(one, ast.Constant):
                scaled = one.value * self.factor
                one.value = max(1, round(scaled)) if isinstance(one.value, int) and one.value else scaled


class _Finder:
    """Finds one module of the naming before anything else does."""

    def __init__(self, constant: Constant, factor: float) -> None:
        self.constant, self.factor = constant, factor

    def find_spec(self, fullname: str, path: object = None, target: ModuleType | None = None) -> object:
        """The changed module; None for all other ones."""
        if fullname != f"slipstick.{self.constant[0]}":
            return None
        file = _source(self.constant)
        loader = _Scaled(fullname, str(file))
        loader.name, loader.factor = self.constant[1], self.factor
        return spec_from_file_location(fullname, file, loader=loader)


def swept(job: tuple[Constant, float, list[str], int]) -> dict[str, object]:
    """The answers to the cases with one constant times a factor; runs in a fresh process."""
    constant, factor, chosen, most = job
    for module in [name for name in sys.modules if name.startswith(("slipstick.blocks", "slipstick.naming"))]:
        del sys.modules[module]
    changes = {}
    if constant[0] == "settings":
        value = getattr(NamingSettings(), constant[1])
        changes = {constant[1]: max(1, round(value * factor)) if isinstance(value, int) else value * factor}
    elif factor != 1:
        sys.meta_path.insert(0, _Finder(constant, factor))  # type: ignore[arg-type]
        if "njit" in _source(constant).read_text():  # numba's cache does not see that a constant of a kernel changed
            own_cache = TemporaryDirectory()  # removed when this function returns
            numba.config.CACHE_DIR = own_cache.name

    from benchmarks.benches import BENCHES
    from benchmarks.naming import recorded
    from slipstick.naming.settings import NamingSettings as Settings
    from slipstick.naming.study import name
    from slipstick.recordings import Recordings

    numba.set_num_threads(1)
    answers = {}
    for identity in chosen:
        try:
            recordings = Recordings.open(recorded("development", identity))
            some = recordings.take(np.linspace(0, len(recordings) - 1, min(most, len(recordings))).astype(int))
            found = name(BENCHES[cases.LISTS["development"][identity].bench], some, Settings(**changes))
            answers[identity] = [[list(one.pair) for one in found.findings], list(found.lacking)]
        except Exception as error:  # an answer as well: a constant without which nothing runs decides
            answers[identity] = [[], [type(error).__name__]]
    return {"constant": list(constant), "factor": factor, "answers": answers}


def others(some: list[Constant]) -> tuple[list[list[Any]], str]:
    """The rows of the table for all constants but `some`, and the command that made them."""
    kept = [one for one in constants() if one not in some]
    *rows, last = csv.reader(TABLE.read_text().splitlines()[1:])
    return ([[*row[:2], *map(int, row[2:])] for row in rows if tuple(row[:2]) in kept],
            last[0].removeprefix("made by `").rpartition("`: ")[0])


def main(count: int = 30, processes: int = 2, engagements: int = 54, names: Sequence[str] = ()) -> None:
    """Sweep what has no line yet of the constants with these `names`, by default of all, and write the table."""
    some = [one for one in constants() if not names or ".".join(one) in names]
    eligible = [name for name, case in cases.LISTS["development"].items()
                if case.count <= 54 and len(case.effects) <= 1]
    chosen = [eligible[place] for place in np.linspace(0, len(eligible) - 1, count).astype(int)]
    LINES.parent.mkdir(exist_ok=True)
    done = {(tuple(one["constant"]), one["factor"]): one["answers"]
            for one in map(json.loads, LINES.read_text().splitlines())} if LINES.exists() else {}
    nothing = "settings", "nats"
    jobs = [(nothing, 1.0, chosen, engagements),
            *((one, factor, chosen, engagements) for one in some for factor in FACTORS[1:])]
    with ProcessPoolExecutor(processes, get_context("spawn"), max_tasks_per_child=1) as pool, LINES.open("a") as file:
        futures = [pool.submit(swept, job) for job in jobs
                   if set(chosen) - set(done.get((job[0], job[1]), ()))]
        for future in as_completed(futures):
            entry = future.result()
            done[tuple(entry["constant"]), entry["factor"]] = entry["answers"]
            file.write(json.dumps(entry) + "\n")
            file.flush()
            print(*entry["constant"], entry["factor"], flush=True)
    given = done[nothing, 1.0]
    rows = [[*one, *(sum(done[one, factor][case] != given[case] for case in chosen) for factor in FACTORS[1:]),
             len(chosen)] for one in some]
    made_by = " ".join([f"python -m benchmarks.constants {count} {processes} {engagements}", *names])
    if names:
        kept, before = others(some)
        rows, made_by = rows + kept, f"{made_by}` and, other rows, `{before}"
    write("constants", ("module", "constant", "answers changed by half", "by double", "of"),
          sorted(rows, key=lambda row: -max(row[2], row[3])),
          made_by)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:4]), names=sys.argv[4:])
