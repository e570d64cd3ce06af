"""Pronouns tell a reader nothing as names: no package has them."""

import io
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PRONOUNS = {"one", "its", "found", "some", "everything"}


def pronouns_in(folder: Path) -> list[str]:
    """Where pronouns are names in the files of a package, comments and texts excluded."""
    return [f"{path.name}:{token.start[0]}: {token.string}" for path in sorted(folder.rglob("*.py"))
            for token in tokenize.generate_tokens(io.StringIO(path.read_text()).readline)
            if token.type == tokenize.NAME and token.string in PRONOUNS]


PACKAGES = sorted(["service", "worker", "evidence", "benchmarks", "docs", *(
    f"slipstick/{path.name}" for path in (ROOT / "slipstick").iterdir() if (path / "__init__.py").exists())])


@pytest.mark.parametrize("package", PACKAGES)
def test_names_are_no_pronouns(package: str) -> None:
    assert pronouns_in(ROOT / package) == [], "Say in the name what the value is"


def test_names_are_seen_and_words_in_texts_are_not(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text('def find(its):\n    """Of one."""\n    found = [one for one in its]  # some\n')
    assert pronouns_in(tmp_path) == ["module.py:1: its", "module.py:3: found", "module.py:3: one", "module.py:3: one",
                                     "module.py:3: its"]
