"""Equal declarations have equal digests, whatever their comments; other equations, numbers and settings do not."""

import subprocess
import sys
from pathlib import Path

import pytest

from slipstick.engine.settings import EngineSettings
from slipstick.machine.digest import digest
from slipstick.machine.kinds import KINDS

TANKS = Path(__file__).parents[3] / "tables" / "machines" / "two_tanks.py"
SHAPE = """
import numpy as np
LIMIT = 2.0
def bend(x, at=1.5):
    \"\"\"What bends.\"\"\"
    return np.maximum(x - at, 0) * LIMIT
def take(x):
    # the middle
    return bend(x) if x < 3 else take(x - 1)
"""


def digest_of(source: str, name: str = "take") -> str:
    scope: dict[str, object] = {"__name__": "declared"}
    exec(compile(source, "declared.py", "exec"), scope)
    return digest(scope[name])


@pytest.mark.parametrize(("before", "after"), [
    ("# the middle", "# the middle of it"), ("What bends.", "What is bent."), ("LIMIT = 2.0\n", "LIMIT = 2.0\n\n\n"),
    ("return bend(x) if x < 3 else take(x - 1)", "return (bend(x)\n            if x < 3 else take(x - 1))"),
    ("LIMIT = 2.0", "LIMIT, OTHER = 2.0, 3.0")])
def test_texts_and_layout_do_not_count(before: str, after: str) -> None:
    assert before in SHAPE
    assert digest_of(SHAPE) == digest_of(SHAPE.replace(before, after))


@pytest.mark.parametrize(("before", "after"), [
    ("x < 3", "x < 4"), ("x < 3", "x <= 3"), ("LIMIT = 2.0", "LIMIT = 2.5"), ("at=1.5", "at=1.0"),
    ("np.maximum", "np.minimum"), ("x - at", "at - x"), ("take(x - 1)", "bend(x - 1)")])
def test_code_numbers_and_helpers_count(before: str, after: str) -> None:
    assert before in SHAPE
    assert digest_of(SHAPE) != digest_of(SHAPE.replace(before, after))


def machine_digest(source: str) -> str:
    return digest_of(source, "MACHINE")


@pytest.mark.parametrize(("before", "after", "counts"), [
    ('"""Return the rate of level 1 in m/s."""', "", False), ("BRIM = 0.02, 0.6", "BRIM = 0.02, 0.7", True),
    ("- q.leak_1)", "- 2 * q.leak_1)", True), ("within=0.03", "within=0.04", True)])
def test_a_machine_is_what_it_declares(before: str, after: str, counts: bool) -> None:
    source = TANKS.read_text()
    assert before in source
    assert (machine_digest(source) != machine_digest(source.replace(before, after))) == counts


def test_settings_and_kinds_count() -> None:
    assert digest(EngineSettings()) == digest(EngineSettings())
    assert digest(EngineSettings()) != digest(EngineSettings(nats=13))
    assert digest(KINDS) != digest(KINDS[:-1])


def test_another_process_has_the_same_digest() -> None:
    code = ("import runpy, sys; from slipstick.machine.digest import digest; from slipstick.machine.kinds import KINDS;"
            "print(digest(runpy.run_path(sys.argv[1])['MACHINE'], KINDS))")
    printed = {subprocess.run([sys.executable, "-c", code, str(TANKS)], capture_output=True, text=True,
                              check=True).stdout for _ in range(2)}
    assert len(printed) == 1
    assert len(printed.pop().strip()) == 64
