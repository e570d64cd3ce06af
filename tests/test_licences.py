"""The licence, and the notices of bundled software: complete, and part of every installation."""

import shutil
import subprocess
import sys
import tomllib
import zipfile
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


def test_a_wheel_contains_the_licence_and_the_notices(tmp_path: Path) -> None:
    source = tmp_path / "source"  # a build leaves files behind
    for folder in ("slipstick", "service", "worker"):
        shutil.copytree(ROOT / folder, source / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for file in ("pyproject.toml", "README.md", "LICENSE", "NOTICES.md"):
        shutil.copy(ROOT / file, source)
    subprocess.run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir",
                    str(tmp_path), str(source)], check=True, capture_output=True)
    wheel, = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    for text in ("LICENSE", "NOTICES.md", *licence_texts(BUNDLES[0])):
        assert any(name.endswith(f"licenses/{text}") for name in names), text
