"""The licence, and the notices of bundled software. tests/test_wheel.py checks that they are part of the wheel."""

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
BUNDLES = ("service/static/swagger", "tests/data/compose_spec")
NOTICES = (ROOT / "NOTICES.md").read_text()


def licence_texts(bundle: str) -> list[str]:
    return [f"{bundle}/{path.name}" for path in (ROOT / bundle).iterdir()
            if "LICENSE" in path.name or path.name == "NOTICE"]


def test_the_licence_is_bsd_3_clause() -> None:
    assert PROJECT["license"] == "BSD-3-Clause"
    assert (ROOT / "LICENSE").read_text().startswith("BSD 3-Clause License")


@pytest.mark.parametrize("bundle", BUNDLES)
def test_the_notices_list_every_licence_text(bundle: str) -> None:
    texts = licence_texts(bundle)
    assert texts
    for text in texts:
        assert f"({text})" in NOTICES
