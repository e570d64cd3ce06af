"""Pronouns tell a reader nothing as names: where they still stand they are counted, and the counts may only fall."""

import io
import tokenize
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PRONOUNS = {"one", "its", "found", "some", "everything"}
MOST = {"slipstick/naming": 179}
"""Package -> how often it has them. Other packages have none."""


def counted(folder: Path) -> int:
    """How often pronouns are names in the files of a package, comments and texts excluded."""
    words: Counter[str] = Counter()
    for path in folder.rglob("*.py"):
        words.update(token.string for token in tokenize.generate_tokens(io.StringIO(path.read_text()).readline)
                     if token.type == tokenize.NAME)
    return sum(words[pronoun] for pronoun in PRONOUNS)


PACKAGES = sorted(["service", "worker", "evidence", "benchmarks", "docs", *(
    f"slipstick/{path.name}" for path in (ROOT / "slipstick").iterdir() if (path / "__init__.py").exists())])


@pytest.mark.parametrize("package", PACKAGES)
def test_names_are_no_pronouns(package: str) -> None:
    count = counted(ROOT / package)
    assert count <= MOST.get(package, 0), "Say in the name what the value is"
    assert count == MOST.get(package, 0), f"There are fewer now: write {count} for {package} above"


def test_names_are_counted_and_words_in_texts_are_not(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text('def find(its):\n    """Of one."""\n    found = [one for one in its]  # some\n')
    assert counted(tmp_path) == 5
