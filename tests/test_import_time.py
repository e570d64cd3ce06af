"""Importing `slipstick` and asking a command for help is instant, because no library is imported before it is used.

Times depend on the machine, so the tests look at what was imported: numpy, numba and SciPy take most of a second.
"""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.test_imports import imported, modules

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]


def modules_of(requirements: list[str]) -> set[str]:
    """The modules of distributions, as far as their names differ: vl-convert-python is `vl_convert`."""
    names = {re.match(r"[\w-]+", requirement)[0] for requirement in requirements}
    return {name.replace("-", "_").removesuffix("_python") for name in names}


CORE = modules_of(PROJECT["dependencies"])
OPTIONAL = modules_of([requirement for extra in ("dask", "fmu", "mdf", "parquet", "reports", "service")
                       for requirement in EXTRAS[extra]])


def loaded(code: str) -> set[str]:
    """Modules that are imported after the code ran in a process of its own."""
    ran = subprocess.run([sys.executable, "-c", f"{code}\nimport sys; print('', *sys.modules, sep='\\n')"], cwd=ROOT,
                         check=True, capture_output=True, text=True)
    return set(ran.stdout.split())


def test_the_names_are_those_of_modules() -> None:
    assert {"numpy", "numba", "scipy", "h5py", "pint", "chaospy"} <= CORE
    assert {"fastapi", "sqlalchemy", "vl_convert", "asammdf", "pyarrow", "distributed"} <= OPTIONAL
    assert loaded("import numpy") >= {"numpy"}  # a process that imports one of them is seen to do so


def test_the_dependencies_are_what_is_imported() -> None:
    """An extra for each library that not everyone needs; fastapi brings starlette, uvicorn h11 and numba llvmlite."""
    needed: dict[str, set[str]] = {"slipstick": set(), "service": set(), "worker": set()}
    for module, path in modules():
        needed[module.split(".")[0]] |= {name.split(".")[0] for name in imported(path)} - sys.stdlib_module_names
    assert needed["slipstick"] - OPTIONAL - {"slipstick"} == CORE - {"numpoly"} | {"llvmlite"}
    assert set.union(*needed.values()) - {*needed, "starlette", "h11", "llvmlite"} == (CORE | OPTIONAL) - {"numpoly"}


@pytest.mark.parametrize("code", [
    "import slipstick; slipstick.__version__; dir(slipstick)",
    "import worker.__main__",
    "from worker.__main__ import main\ntry: main(['--help'])\nexcept SystemExit: pass",
    "import service.__main__",
])
def test_nothing_is_imported_before_it_is_used(code: str) -> None:
    assert not (CORE | OPTIONAL) & loaded(code)


@pytest.mark.parametrize(("code", "late"), [
    ("from slipstick.bench import Bench", {"numba", "scipy", "h5py", "pint"}),
    ("from slipstick.recordings import Recordings", {"numba", "scipy", "pint"}),
    ("import slipstick.table, slipstick.studies, slipstick.interface.study, slipstick.interface.fit",
     {"chaospy", "numpoly", "pint", "scipy.stats", "scipy.signal", "scipy.io"}),
])
def test_what_few_use_is_imported_late(code: str, late: set[str]) -> None:
    assert not (late | OPTIONAL) & loaded(code)


def test_the_core_needs_no_extra() -> None:
    """Every module of the core but the databases of jobs can be imported where no extra is installed."""
    code = f"""
import importlib, pkgutil, sys
for name in {sorted(OPTIONAL)}:
    sys.modules[name] = None  # importing it raises ImportError
import slipstick
for module in pkgutil.walk_packages(slipstick.__path__, "slipstick."):
    if module.name != "slipstick.storage.database":
        importlib.import_module(module.name)
"""
    assert "slipstick.studies" in loaded(code)
