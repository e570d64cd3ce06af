"""The wheel: complete, without a package that is named `service` or `worker`, and enough without the repository."""

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from slipstick.interface.study import Study
from slipstick.recordings import Recordings
from slipstick.table import Table
from tests.test_licences import BUNDLES, licence_texts

ROOT = Path(__file__).parents[1]
BUILD = tomllib.loads((ROOT / "pyproject.toml").read_text())
SETUP = BUILD["tool"]["setuptools"]
FOLDERS = {"slipstick": "slipstick", **SETUP["package-dir"]}
"""Package of the wheel -> folder of the repository."""
SHIPPED = {f"slipstick/shipped/{name}" for name in (
    "compact.toml", "heavy.toml", "machines/dc_motor.py", "machines/dry_clutch.py", "machines/heated_plate.py",
    "machines/two_tanks.py", "sample.h5")}
CODES = shutil.ignore_patterns("__pycache__", "*.tmp.*")


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what the wheel is made of, because a build leaves files behind."""
    folder = tmp_path_factory.mktemp("source")
    for name in FOLDERS.values():
        shutil.copytree(ROOT / name, folder / name, ignore=CODES)
    for name in ("pyproject.toml", "README.md", "LICENSE", "NOTICES.md"):
        shutil.copy(ROOT / name, folder)
    return folder


@pytest.fixture(scope="module")
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, made without a network."""
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-index", "--no-deps", "--no-build-isolation",
                    "--wheel-dir", folder, source], check=True, capture_output=True)
    path, = folder.glob("*.whl")
    return path


def test_the_wheel_has_every_file_of_its_packages_and_nothing_else(source: Path, wheel: Path) -> None:
    names = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    expected = {f"{package}/{path.relative_to(source / FOLDERS[package])}" for package in FOLDERS
                if package != "slipstick.shipped" for path in (source / FOLDERS[package]).rglob("*") if path.is_file()}
    assert names == expected | SHIPPED
    assert {name.split("/")[0] for name in names} == {"slipstick", "slipstick_service", "slipstick_worker"}
    assert wheel.stat().st_size < 4e6  # measured recordings of megabytes are not in it


def test_the_wheel_has_the_licence_and_the_notices(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    for text in ("LICENSE", "NOTICES.md", *licence_texts(BUNDLES[0])):
        assert any(name.endswith(f"licenses/{text}") for name in names), text


Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("empty")


@pytest.fixture(scope="module")
def run(source: Path, wheel: Path, empty: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A function that runs a program of an environment with the wheel, in an empty folder.

    The environment has the dependencies of this one, but not this repository: a path in a .pth file is searched without
    the .pth files in it, such as that of an editable installation. Compiled modules and machine code of numba, which
    take a minute to make, are those of the repository: they count for files of the same size and time.
    """
    folder = tmp_path_factory.mktemp("installed")
    venv.create(folder / "env", symlinks=True)
    binaries = folder / "env" / "bin"
    subprocess.run([sys.executable, "-m", "pip", "--python", binaries / "python", "install", "--quiet", "--no-index",
                    "--no-deps", "--no-compile", wheel], check=True, capture_output=True)
    packages, = (folder / "env" / "lib").glob("python*/site-packages")
    (packages / "dependencies.pth").write_text(sysconfig.get_paths()["purelib"])
    for package in ("slipstick", "slipstick_service", "slipstick_worker"):
        for path in (ROOT / FOLDERS[package]).rglob("*"):
            copy = packages / package / path.relative_to(ROOT / FOLDERS[package])
            if path.suffix == ".py" and copy.exists():
                os.utime(copy, ns=(path.stat().st_atime_ns, path.stat().st_mtime_ns))
            elif path.suffix in (".pyc", ".nbi", ".nbc"):
                copy.parent.mkdir(exist_ok=True)
                shutil.copy(path, copy)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def start(program: str, *arguments: str, check: bool = True) -> subprocess.CompletedProcess[str]:
        ran = subprocess.run([binaries / program, *arguments], cwd=empty, env=environment, text=True,
                             capture_output=True, check=False)
        assert not check or ran.returncode == 0, ran.stderr
        return ran

    return start


def test_the_command_is_installed(run: Run) -> None:
    assert BUILD["project"]["version"] in run("slipstick", "--version").stdout
    listing = run("slipstick", "--help").stdout
    assert "usage: slipstick" in listing
    assert "study" in listing


def test_the_packages_are_those_of_the_wheel(run: Run) -> None:
    code = "import slipstick, slipstick_service, slipstick_worker as worker; " \
           "print(slipstick.__file__, slipstick_service.__file__, worker.__file__)"
    assert all("/env/" in path for path in run("python", "-c", code).stdout.split())
    for package in ("service", "worker"):
        ran = run("python", "-c", f"import {package}", check=False)
        assert "ModuleNotFoundError" in ran.stderr


@pytest.mark.slow
def test_every_module_of_the_wheel_can_be_imported(run: Run) -> None:
    code = """
import importlib, pkgutil, slipstick, slipstick_service, slipstick_worker
for package in (slipstick, slipstick_service, slipstick_worker):
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        if not module.name.endswith(".__main__"):
            importlib.import_module(module.name)
            print(module.name)
"""
    assert {"slipstick.bench.reader", "slipstick_service.routes.fits", "slipstick_worker.study"} <= set(
        run("python", "-c", code).stdout.split())


def test_no_module_imports_another_by_its_name_in_the_repository() -> None:
    """`worker.plan` is `slipstick_worker.plan` in the wheel: modules name each other relatively."""
    absolute = re.compile(r"^\s*(from|import) (service|worker)\b", re.MULTILINE)
    paths = [path for folder in FOLDERS.values() for path in (ROOT / folder).rglob("*.py")]
    assert len(paths) > 300
    assert [path for path in paths if absolute.search(path.read_text())] == []


def test_python_has_benches_and_recordings_in_any_folder(run: Run) -> None:
    code = """
import slipstick
print(slipstick.Bench.open("heavy").name, slipstick.Bench.open("compact.toml").name)
print(len(slipstick.Recordings.open("sample")))
"""
    assert run("python", "-c", code).stdout == "heavy compact\n54\n"


@pytest.mark.slow
def test_a_study_examines_the_first_blocks(run: Run) -> None:
    code = """
import slipstick

def stop_in_the_middle(doing, done):
    if done > 0.4:
        raise InterruptedError(doing)

slipstick.study("heavy", slipstick.Recordings.open("sample").take(range(24)), progress=stop_in_the_middle)
"""
    assert "InterruptedError: step 6 of 12: Block" in run("python", "-c", code, check=False).stderr


LESS = {'Recordings.open("sample")': 'Recordings.open("few.h5")',
        'study(bench, runs, budget="5 min", progress=False, name="sample")': 'open_result("few.json")',
        "(0.5, 2, 50)": "(0.5, 2, 9)", "conditions=[0, 20, 53]": "conditions=[0, 10, 23]",
        "fit(table, runs, ": "fit(table, runs, generations=2, "}
"""Changes of the quickstart: a study that is computed already, fewer points, and a shorter search."""


@pytest.fixture(scope="module")
def few(study_of_few: Study, few_recordings: Path, empty: Path) -> None:
    """The study that all tests share, and its recordings, in the empty folder."""
    said = Recordings.open("sample").description
    (empty / "few.h5").write_bytes(replace(Recordings.open(few_recordings / "few.h5"), description=said).to_bytes())
    study_of_few.save(empty / "few.json")


@pytest.mark.parametrize("changes", [LESS, pytest.param({}, marks=pytest.mark.slow)], ids=["less", "whole"])
@pytest.mark.usefixtures("few")
def test_the_quickstart_runs_without_the_repository(run: Run, changes: dict[str, str]) -> None:
    """What it prints is what is kept in it; of less, but for the numbers."""
    cells = json.loads((ROOT / "docs" / "quickstart.ipynb").read_text())["cells"]
    code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    for whole, less in changes.items():
        assert whole in code
        code = code.replace(whole, less)
    kept = ["".join(shown["text"]) for cell in cells for shown in cell.get("outputs", ()) if "text" in shown]
    printed, expected = run("python", "-c", code).stdout, "".join(kept)
    if changes:
        printed, expected = (re.sub(r"-?\d[\d.]*", "0", text) for text in (printed, expected))
    assert printed == expected


def test_the_command_makes_a_table_in_any_folder(run: Run, empty: Path) -> None:
    run("slipstick", "build", "--bench", "heavy", "--axis", "pressure_bias=0.9:1.1:2", "--axis",
        "initial_position=0.9:1.1:2", "--out", "two.h5")
    assert Table.open(empty / "two.h5").times.shape == (2, 2, 216)


def test_what_does_not_exist_is_refused_in_one_line(run: Run) -> None:
    ran = run("slipstick", "study", "nothing.h5", "--bench", "heavi", check=False)
    assert ran.returncode == 1
    assert ran.stderr.startswith("error: There is no ")
    assert "heavy" in ran.stderr
    assert "Traceback" not in ran.stderr
