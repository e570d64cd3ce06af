"""Imports run one way: service -> slipstick <- worker, and inside the core from the simulator outwards."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FORBIDDEN = {
    "slipstick": ("service", "worker", "fastapi", "uvicorn", "dbos", "pydantic"),
    "slipstick/clutch": ("slipstick.table", "slipstick.recordings", "slipstick.uncertainty", "slipstick.calibration"),
    "slipstick/clutch/effects": ("slipstick.clutch.model", "slipstick.clutch.ensemble", "slipstick.clutch.driver"),
    "slipstick/uncertainty": ("slipstick.clutch", "slipstick.table", "slipstick.recordings", "slipstick.calibration"),
    "service": ("worker", "slipstick.clutch.ensemble"),
    "worker": ("service",),
}


def imported(path: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
            names.update(f"{node.module}.{alias.name}" for alias in node.names)
    return names


@pytest.mark.parametrize("folder", FORBIDDEN)
def test_imports_run_one_way(folder: str) -> None:
    files = list((ROOT / folder).rglob("*.py"))
    assert files
    for path in files:
        for name in imported(path):
            for forbidden in FORBIDDEN[folder]:
                assert not f"{name}.".startswith(f"{forbidden}."), f"{path} imports {name}"
