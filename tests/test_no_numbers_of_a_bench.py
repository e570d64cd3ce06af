"""No number of a shipped bench stands in the code: benches are files.

Many numbers of a bench, such as 0.5 or 20, occur in the code for other reasons. A literal is taken for one of a bench
if it has three significant digits (two below 0.01, where parameters are), if four literals in a row are four of a
curve, of a profile or of a factor, or if it stands beside the name of the parameter whose value it is.
"""

import ast
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipstick.bench import parameters
from tests.benches import BENCHES, TABLES

ROOT = Path(__file__).parents[1]
FILES = [path for folder in ("slipstick", "worker", "service") for path in sorted((ROOT / folder).rglob("*.py"))]
IN_A_ROW = 4


def written(value: Any) -> Iterator[list[float]]:
    """The numbers of a TOML value, lists as they stand, in the units of the file."""
    if isinstance(value, dict):
        for one in value.values():
            yield from written(one)
    elif isinstance(value, list) and all(isinstance(one, int | float) for one in value):
        yield [float(one) for one in value]
    elif isinstance(value, list):
        for one in value:
            yield from written(one)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield [float(value)]
    elif isinstance(value, str) and value[:1].isdigit() and " " in value:
        yield [float(value.split()[0])]


def lists() -> list[list[float]]:
    """All lists of numbers of the benches, as written and in the units of the model; a number is a list of one."""
    found = []
    for bench in BENCHES:
        document = tomllib.loads((TABLES / f"{bench.name}.toml").read_text())
        found += [numbers for key in ("parameters", "converter", "sensors", "conditions", "profiles")
                  for numbers in written(document[key])]
        factors = bench.conditions.columns()[1:]
        found += [list(bench.physics.nominal), *(np.unique(column).tolist() for column in factors)]
    return found


def key(number: float) -> str:
    return f"{number:.6g}"


def is_distinctive(number: float) -> bool:
    digits = f"{abs(number):.5e}".split("e")[0].replace(".", "").rstrip("0")
    is_power_of_two = number != 0 and np.frexp(abs(number))[0] == 0.5
    return not is_power_of_two and len(digits) >= (2 if abs(number) < 0.01 else 3)


DISTINCTIVE = {key(number) for numbers in lists() for number in numbers if is_distinctive(number)}
ROWS = {tuple(map(key, numbers[k:k + IN_A_ROW])) for numbers in lists() for k in range(len(numbers) - IN_A_ROW + 1)}
NOMINAL = {(name, key(value)) for bench in BENCHES
           for name, value in zip(parameters.NAMES, bench.physics.nominal, strict=True) if value != 1}


def number(node: ast.AST | None) -> float | None:
    value = node.value if isinstance(node, ast.Constant) else None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def named(node: ast.AST) -> Iterator[tuple[str, ast.AST | None]]:
    """Names with what is assigned to them, or stands beside them in a call, a dictionary or a tuple."""
    if isinstance(node, ast.Assign):
        yield from ((target.id.lower(), node.value) for target in node.targets if isinstance(target, ast.Name))
    elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
        yield node.target.id.lower(), node.value
    elif isinstance(node, ast.keyword) and node.arg:
        yield node.arg, node.value
    elif isinstance(node, ast.Dict):
        pairs = zip(node.keys, node.values, strict=True)
        yield from ((str(one.value), value) for one, value in pairs if isinstance(one, ast.Constant))
    elif isinstance(node, ast.Call | ast.Tuple | ast.List):
        inside = node.args if isinstance(node, ast.Call) else node.elts
        names = [one.value for one in inside if isinstance(one, ast.Constant) and isinstance(one.value, str)]
        yield from ((name, one) for name in names for one in inside)


def numbers_of_a_bench(source: str) -> list[str]:
    """What in the source is a number of a bench, with its line; texts and comments are not looked at."""
    found = []
    for node in ast.walk(ast.parse(source)):
        place = f"line {getattr(node, 'lineno', 0)}"
        value = number(node)
        if value is not None and key(value) in DISTINCTIVE:
            found.append(f"{place}: {value:g}")
        if isinstance(node, ast.Tuple | ast.List):
            row = [None if one is None else key(one) for one in map(number, node.elts)]
            found += [f"{place}: {row[k:k + IN_A_ROW]}" for k in range(len(row)) if tuple(row[k:k + IN_A_ROW]) in ROWS]
        found += [f"{place}: {name} {given:g}" for name, beside in named(node)
                  if (given := number(beside)) is not None and (name, key(given)) in NOMINAL]
    return found


def test_the_code_has_no_number_of_a_bench() -> None:
    assert len(FILES) > 100
    found = {str(path.relative_to(ROOT)): hits for path in FILES if (hits := numbers_of_a_bench(path.read_text()))}
    assert found == {}


@pytest.mark.parametrize("source", [
    'Parameter("gear_ratio", "g_r", 3.2, "1", "gear ratio")', 'Parameter("current_gain", "k", "bar/A", "gain", 20)',
    "gear_ratio = 1.8", "GEAR_RATIO: float = 3.2", "simulate(input_inertia=0.25)", 'values = {"pressure_bias": 1.6}',
    'START = [("current_delay", 0.05)]', "FRICTION = 3.2e-4", "def f(beta=1.5e-5): ...", "x = 26.3",
    "SPEED_RATIO = (0, 0.1, 0.2, 0.3, 0.4)", "torque_ratio = np.array([2.2, 2.06, 1.91])",
    "profile = (0, 0.002, 0.105)", "current = [0.1, 0.7, 0.7, 0.3, 0.3]", "rpm = (1000, 1300, 1600, 1900)",
    "speed = 104.7197551", "t = 0.96 + 0.955",
])
def test_a_number_of_a_bench_would_be_found(source: str) -> None:
    assert numbers_of_a_bench(source)


@pytest.mark.parametrize("source", [
    '"""A gear ratio of 3.2 and 104.7197551 rad/s."""', "gear_ratio = 3.3", "x = 3.2  # gear_ratio = 3.2",
    "grid = (0.5, 1.5, 50)", "times = 1.0, 2.0, 3.0, 4.0", "temperature_gain = 1.0", "step = 0.125",
])
def test_other_numbers_are_none_of_a_bench(source: str) -> None:
    assert numbers_of_a_bench(source) == []
