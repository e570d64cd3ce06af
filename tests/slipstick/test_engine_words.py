"""The engine knows no machine: no word of one is in its code, texts or comments, but for what it imports."""

import re
from pathlib import Path

import pytest

ENGINE = Path(__file__).parents[2] / "slipstick" / "engine"
WORDS = ("pressure|torque|clutch|valve|piston|converter|slip|lock|plates?|brake|gear|engagements?|oil|film|friction|"
         "bench|pump|tank|motor|shaft|speed|level 1")


def list_lines(source: str) -> list[str]:
    """The lines of a module without its imports."""
    source = re.sub(r"^from [^\n]*import \((?:[^)]*)\)", "", source, flags=re.MULTILINE)
    return [line for line in source.splitlines() if not re.match(r"\s*(from|import) ", line)]


def words_of_machines(source: str) -> list[str]:
    lines = [re.sub("_", " ", line.lower()) for line in list_lines(source)]
    return [word for line in lines for word in re.findall(rf"\b(?:{WORDS})\b", line)]


@pytest.mark.parametrize("path", sorted(ENGINE.glob("*.py")), ids=lambda path: path.name)
def test_the_engine_has_no_word_of_a_machine(path: Path) -> None:
    assert words_of_machines(path.read_text()) == []


def test_words_of_machines_are_recognized() -> None:
    assert words_of_machines("from slipstick.clutch import valve\nx = oil_pressure  # of the clutch\n") == [
        "oil", "pressure", "clutch"]
