"""What each package may import: an allow-list, so that a new dependency between packages is a decision.

Imports run one way, service -> slipstick <- worker, and inside the core from the simulator outwards.
docs/architecture.md draws the same picture.
"""

import ast
import importlib
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

# Package or module -> what it may import beside itself and the standard library; the longest matching entry applies.
MAY_IMPORT = {
    "slipstick": "",
    "slipstick.errors": "",
    "slipstick.time_budget": "slipstick.errors slipstick.numerics",
    "slipstick.numerics": "numpy numba llvmlite pint threadpoolctl slipstick.errors",
    "slipstick.bench": "numpy slipstick.errors slipstick.numerics slipstick.storage.sheet slipstick.storage.shipped",
    "slipstick.clutch": "numpy scipy numba llvmlite slipstick.errors slipstick.numerics "
                        "slipstick.bench slipstick.clutch.effects slipstick.law_files",
    "slipstick.clutch.declared": "numpy scipy slipstick.bench slipstick.clutch slipstick.machine slipstick.recordings",
    "slipstick.clutch.effects": "numpy scipy slipstick.errors slipstick.bench.scales slipstick.clutch.fastmath "
                                "slipstick.clutch.lag",
    "slipstick.storage.files": "",
    "slipstick.storage.cells": "",
    "slipstick.storage.database": "sqlalchemy slipstick.errors",
    "slipstick.storage.children": "slipstick.errors slipstick.interruption",
    "slipstick.storage.isolated": "slipstick.errors slipstick.storage.children",
    "slipstick.storage.hdf5": "numpy h5py slipstick.errors",
    "slipstick.storage.sheet": "numpy slipstick.errors slipstick.numerics slipstick.storage.cells",
    "slipstick.storage.condition_layout": "numpy h5py slipstick.errors slipstick.bench slipstick.storage.hdf5",
    "slipstick.storage.versions": "h5py slipstick.errors slipstick.bench slipstick.machine slipstick.recordings "
                                  "slipstick.table slipstick.black_box",
    "slipstick.storage.library": "numpy slipstick.errors slipstick.bench slipstick.machine slipstick.storage.files "
                                 "slipstick.storage.versions slipstick.recordings slipstick.table slipstick.black_box",
    "slipstick.recordings": "numpy h5py slipstick.errors slipstick.numerics slipstick.bench "
                            "slipstick.storage.condition_layout slipstick.storage.files slipstick.storage.hdf5 "
                            "slipstick.storage.isolated "
                            "slipstick.storage.sheet slipstick.storage.shipped",
    "slipstick.acquisition": "numpy scipy h5py asammdf pyarrow slipstick.errors slipstick.numerics slipstick.bench "
                             "slipstick.machine slipstick.recordings slipstick.storage.cells slipstick.storage.hdf5 "
                             "slipstick.storage.isolated",
    "slipstick.acquisition.comparison": "numpy slipstick.bench slipstick.clutch slipstick.recordings",
    "slipstick.black_box": "numpy h5py fmpy slipstick.errors slipstick.interruption slipstick.numerics "
                           "slipstick.bench.document slipstick.engine.simulation slipstick.machine "
                           "slipstick.storage.children slipstick.storage.hdf5 slipstick.storage.sheet "
                           "slipstick.storage.shipped",
    "slipstick.table": "numpy numba h5py slipstick.errors slipstick.numerics slipstick.bench slipstick.clutch "
                       "slipstick.black_box slipstick.storage.condition_layout slipstick.storage.files "
                       "slipstick.storage.hdf5 slipstick.storage.isolated",
    "slipstick.building": "numpy scipy numba slipstick.__version__ slipstick.errors slipstick.numerics slipstick.bench "
                          "slipstick.black_box slipstick.clutch slipstick.storage.files slipstick.table "
                          "slipstick.uncertainty.chaos",
    "slipstick.plausibility": "numpy slipstick.bench slipstick.clutch slipstick.pictures "
                              "slipstick.recordings.signals",
    "slipstick.plausibility.machine": "numpy slipstick.engine slipstick.errors slipstick.machine "
                                      "slipstick.plausibility.finding",
    "slipstick.plausibility.mismatch": "numpy slipstick.errors slipstick.bench slipstick.blocks.load slipstick.clutch "
                                       "slipstick.recordings",
    "slipstick.table.physical_values": "slipstick.table",
    "slipstick.recordings.simulated": "numpy slipstick.errors slipstick.bench slipstick.clutch slipstick.recordings",
    "slipstick.blocks": "numpy scipy numba slipstick.errors slipstick.bench slipstick.clutch slipstick.engine.noise "
                        "slipstick.engine.whitening slipstick.recordings",
    "slipstick.calibration": "numpy scipy slipstick.errors slipstick.bench slipstick.blocks slipstick.clutch "
                             "slipstick.engine.linear_model slipstick.plausibility.mismatch slipstick.recordings "
                             "slipstick.time_budget",
    # The uncertainty package knows a model as points in, shifting times out: no simulator, table or recordings.
    "slipstick.uncertainty": "",
    "slipstick.uncertainty.sampling": "numpy scipy slipstick.errors",
    "slipstick.uncertainty.chaos": "numpy scipy numba chaospy slipstick.errors slipstick.numerics "
                                   "slipstick.uncertainty.sampling",
    "slipstick.uncertainty.inputs": "numpy slipstick.errors slipstick.uncertainty.chaos",
    "slipstick.uncertainty.outside": "numpy scipy slipstick.uncertainty.chaos slipstick.uncertainty.inputs",
    "slipstick.uncertainty.likelihood": "numpy scipy numba slipstick.errors slipstick.numerics "
                                        "slipstick.uncertainty.chaos "
                                        "slipstick.uncertainty.inputs slipstick.uncertainty.sampling",
    "slipstick.uncertainty.fit": "numpy scipy slipstick.errors slipstick.numerics slipstick.uncertainty.chaos "
                                 "slipstick.uncertainty.likelihood slipstick.uncertainty.outside "
                                 "slipstick.uncertainty.sampling slipstick.time_budget",
    "slipstick.inference": "numpy slipstick.errors slipstick.bench slipstick.clutch slipstick.black_box "
                           "slipstick.plausibility.mismatch slipstick.recordings slipstick.table "
                           "slipstick.time_budget slipstick.uncertainty",
    # The engine knows no machine, and a machine no engine.
    "slipstick.machine": "numpy scipy h5py slipstick.errors slipstick.storage.files slipstick.storage.hdf5 "
                         "slipstick.storage.isolated slipstick.storage.shipped",
    "slipstick.machine.doubts": "numpy slipstick.machine slipstick.numerics.quantities",
    "slipstick.machine.description": "numpy pydantic slipstick.errors slipstick.machine",
    "slipstick.engine": "numpy scipy numba slipstick.errors slipstick.machine slipstick.numerics",
    "slipstick.machine_studies": "numpy slipstick.black_box.ranges slipstick.engine slipstick.errors "
                                 "slipstick.law_files slipstick.machine slipstick.studies slipstick.time_budget",
    "slipstick.law_files": "numpy scipy slipstick.errors",
    "slipstick.law_files.machine_law": "numpy slipstick.errors slipstick.engine slipstick.machine slipstick.law_files",
    "slipstick.naming": "numpy scipy numba slipstick.errors slipstick.numerics slipstick.bench slipstick.blocks "
                        "slipstick.engine.linear_model "
                        "slipstick.clutch slipstick.recordings",
    "slipstick.confirmation": "numpy scipy numba slipstick.errors slipstick.numerics slipstick.bench "
                              "slipstick.blocks.whitening slipstick.clutch slipstick.engine.linear_model "
                              "slipstick.naming slipstick.recordings",
    "slipstick.studies": "numpy scipy slipstick.errors slipstick.numerics slipstick.bench slipstick.clutch "
                       "slipstick.confirmation slipstick.law_files slipstick.naming slipstick.plausibility.mismatch "
                       "slipstick.recordings slipstick.time_budget",
    "slipstick.pictures": "numpy scipy vl_convert slipstick.errors slipstick.numerics slipstick.uncertainty",
    "slipstick.pictures.machine": "slipstick.machine slipstick.pictures",
    "slipstick.pictures.machine_study": "slipstick.machine_studies slipstick.pictures",
    "slipstick.pictures.study": "scipy slipstick.clutch.effects slipstick.pictures slipstick.recordings.signals "
                                "slipstick.studies",
    "slipstick.report": "numpy slipstick.__version__ slipstick.pictures slipstick.recordings slipstick.time_budget",
    "slipstick.report.calibration": "slipstick.bench slipstick.calibration slipstick.machine_studies "
                                    "slipstick.pictures slipstick.recordings.signals slipstick.report",
    "slipstick.report.imported": "slipstick.__version__ slipstick.acquisition slipstick.bench slipstick.machine "
                                 "slipstick.pictures slipstick.recordings.signals slipstick.report",
    "slipstick.report.machine_study": "slipstick.machine_studies slipstick.pictures slipstick.report slipstick.studies",
    "slipstick.report.made": "slipstick.errors slipstick.pictures slipstick.report",
    "slipstick.report.propagation": "numpy slipstick.__version__ slipstick.pictures slipstick.report "
                                    "slipstick.uncertainty",
    "slipstick.report.study": "numpy scipy slipstick.bench.parameters slipstick.clutch.effects slipstick.law_files "
                              "slipstick.pictures slipstick.recordings slipstick.report slipstick.studies",
    "slipstick.interface": "numpy numba slipstick",
    "service": "numpy fastapi starlette uvicorn h11 pydantic pydantic_settings orjson prometheus_client sqlalchemy "
               "dbos slipstick",
    "worker": "numpy scipy dbos sqlalchemy slipstick",
    "worker.cluster": "distributed llvmlite slipstick",
}
FORBIDDEN = {"service": ("slipstick.clutch.ensemble",)}  # it simulates through `slipstick.inference`


@cache
def modules() -> list[tuple[str, Path]]:
    return [(".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"), path)
            for top in ("slipstick", "service", "worker") for path in (ROOT / top).rglob("*.py")]


@cache
def imported(path: Path) -> list[str]:
    return list(_imported(path))


def _imported(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            package = path.relative_to(ROOT).parts[:-node.level] if node.level else ()
            base = ".".join([*package, *([node.module] if node.module else [])])
            yield from (f"{base}.{alias.name}" for alias in node.names)


def within(name: str, package: str) -> bool:
    return f"{name}.".startswith(f"{package}.")


def entry(module: str) -> str:
    return max((package for package in MAY_IMPORT if within(module, package)), key=len)


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_a_package_imports_only_what_it_may(package: str) -> None:
    files = [(module, path) for module, path in modules() if entry(module) == package]
    assert files
    allowed = [package, *MAY_IMPORT[package].split()]
    for module, path in files:
        for name in imported(path):
            if name.split(".")[0] in sys.stdlib_module_names:
                continue
            assert any(within(name, given) for given in allowed), f"{module} imports {name}"
            assert not any(within(name, barred) for barred in FORBIDDEN.get(package, ())), f"{module} imports {name}"


def test_the_page_of_the_architecture_has_the_imports_of_each_package() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text()
    stated = {name: {word for word in re.split(r"\W+", imports) if word and (ROOT / "slipstick" / word).is_dir()}
              for name, imports in re.findall(r"^\| `slipstick/(\w+)/`[^|]*\|[^|]*\|\s*([^|]*?)\s*\|$", text, re.M)}
    actual = {name: {other.split(".")[1] for module, path in modules() if within(module, f"slipstick.{name}")
                     for other in imported(path) if other.startswith("slipstick.")} for name in stated}
    folders = {path.name for path in (ROOT / "slipstick").iterdir() if (path / "__init__.py").exists()}
    assert set(stated) == folders
    for name, packages in stated.items():
        assert packages - {name} == actual[name] & folders - {name}, name


@pytest.mark.parametrize("package", sorted({module for module, path in modules() if path.name == "__init__.py"}))
def test_a_package_says_what_it_is_for_and_lists_its_public_names(package: str) -> None:
    loaded = importlib.import_module(package)
    assert loaded.__doc__, package
    if package.startswith("slipstick"):
        for name in loaded.__all__:
            assert hasattr(loaded, name) or importlib.import_module(f"{package}.{name}"), name
